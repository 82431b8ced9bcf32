"""Every kind of variable, by the name that YAML uses. A new kind is a class and a line here."""

from __future__ import annotations

from ngi.scene.kinds.appearance import (
    Albedo,
    Intensity,
    Material,
    Radiance,
    Roughness,
    Texels,
    Texture,
    most_materials,
)
from ngi.scene.kinds.placement import KeyFrames, Rotation, Scale, Shape, Translation, Visibility
from ngi.scene.kinds.view import CameraPath, Direction, LookAt
from ngi.scene.variable import Variable

__all__ = [
    "KINDS",
    "Albedo",
    "CameraPath",
    "Direction",
    "Intensity",
    "KeyFrames",
    "LookAt",
    "Material",
    "Radiance",
    "Rotation",
    "Roughness",
    "Scale",
    "Shape",
    "Texels",
    "Texture",
    "Translation",
    "Visibility",
    "most_materials",
]

KINDS: dict[str, type[Variable]] = {
    kind.kind: kind
    for kind in (
        Albedo,
        Roughness,
        Texture,
        Texels,
        Material,
        Intensity,
        Radiance,
        Translation,
        Rotation,
        Scale,
        Visibility,
        Shape,
        KeyFrames,
        LookAt,
        CameraPath,
        Direction,
    )
}
