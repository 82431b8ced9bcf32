"""Every kind of variable, by the name that YAML uses. A new kind is a class and a line here."""

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
from ngi.scene.kinds.numbers import NUMBERS, FieldOfView
from ngi.scene.kinds.placement import KeyFrames, Rotation, Scale, Shape, Translation, Visibility
from ngi.scene.kinds.view import CameraPath, Direction, LookAt
from ngi.scene.variable import Variable

__all__ = [
    "KINDS",
    "Albedo",
    "CameraPath",
    "Direction",
    "FieldOfView",
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

_ALL: tuple[type[Variable], ...] = (
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
    *NUMBERS,
)
KINDS = {kind.kind: kind for kind in _ALL}
