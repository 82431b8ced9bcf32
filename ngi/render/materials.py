"""Albedo and roughness of every BSDF that a camera ray can hit, without evaluating the BSDF.

Mitsuba's own albedo AOV is view-dependent for rough conductors and zero for dielectrics, and it
knows no roughness; here both are looked up in the BSDF's parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ngi.machine.backend import dr, mi
from ngi.scene.scene_files import SceneFile

Lookup = Callable[..., Any]
"""(hit: SurfaceInteraction3f, active: Bool) -> Color3f or Float."""

_WRAPPERS = ("BumpMap", "NormalMap")


@dataclass(frozen=True)
class Material:
    """What the buffers need to know of one BSDF.

    albedo: diffuse, specular or base reflectance, linear RGB; 1 where the BSDF absorbs nothing.
    roughness: alpha; 1 for a diffuse BSDF and 0 for a perfectly smooth one.
    constant_roughness, constant_albedo: the value where it is the same everywhere, else None.
    other_front: what its front has, where its two sides differ.
    """

    bsdf: mi.BSDF
    albedo: Lookup
    roughness: Lookup
    constant_roughness: float | None
    constant_albedo: tuple[float, ...] | None
    other_front: Material | None = None

    @property
    def front(self) -> Material:
        """What its front has."""
        front = self.other_front
        return self if front is None else replace(front, bsdf=self.bsdf)


def collect_materials(bsdfs: list[mi.BSDF]) -> list[Material]:
    """The materials of BSDFs; ValueError for a BSDF of a kind that is not known."""
    return [_material(bsdf) for bsdf in bsdfs]


def materials_in(document: SceneFile, bsdfs: list[mi.BSDF]) -> list[Material]:
    """As `collect_materials` of what a file has, which the error names."""
    try:
        return collect_materials(bsdfs)
    except ValueError as error:
        raise ValueError(f"{document.path}: {error}") from None


def evaluate_materials(
    materials: list[Material], hit: mi.SurfaceInteraction3f, active: mi.Bool
) -> tuple[mi.Color3f, mi.Float]:
    """Albedo and roughness at a hit, zero where it is not active."""
    albedo, roughness = mi.Color3f(0), mi.Float(0)
    if mi.variant().startswith("scalar"):
        if not active:  # asking a miss for its BSDF would crash
            return albedo, roughness
        material = next(material for material in materials if material.bsdf == hit.bsdf())
        return material.albedo(hit, True), material.roughness(hit, True)
    for material in materials:
        here = has_bsdf(hit, material.bsdf, active)
        albedo = dr.select(here, material.albedo(hit, here), albedo)
        roughness = dr.select(here, material.roughness(hit, here), roughness)
    return albedo, roughness


def has_bsdf(hit: mi.SurfaceInteraction3f, bsdf: mi.BSDF, active: mi.Bool) -> mi.Bool:
    """Whether an active hit is on this BSDF."""
    if mi.variant().startswith("scalar"):
        return active and hit.bsdf() == bsdf  # asking a miss for its BSDF would crash
    return active & (hit.bsdf() == mi.BSDFPtr(bsdf))


def _material(bsdf: mi.BSDF) -> Material:
    return replace(_inside(bsdf, bsdf), bsdf=bsdf)


def _inside(inner: mi.BSDF, bsdf: mi.BSDF) -> Material:
    """Of what is inside `bsdf`, which errors name."""
    kind, children = inner.class_name(), children_of(inner)
    if kind == "TwoSidedBRDF":
        front, back = (_inside(children[side], bsdf) for side in ("brdf_0", "brdf_1"))
        return front if children["brdf_0"] == children["brdf_1"] else _two_sided(front, back)
    if kind in _WRAPPERS:
        return _inside(children["nested_bsdf"], bsdf)
    if kind not in _KINDS:
        raise ValueError(
            f"BSDF '{bsdf.id()}' is a {kind}, whose albedo and roughness are not known; use one of "
            f"{', '.join(_plugins())}, or add it to {__name__}"
        )
    albedo_name, roughness_of = _KINDS[kind]
    roughness, constant = roughness_of(inner, children)
    texture = children.get(albedo_name)
    return Material(inner, colour(texture), roughness, constant, _constant_colour(texture))


def _two_sided(front: Material, back: Material) -> Material:
    """What the side that is seen has."""

    def of_side(name: str) -> Lookup:
        sides = [getattr(side, name) for side in (front, back)]

        def lookup(hit: mi.SurfaceInteraction3f, active: mi.Bool) -> Any:
            from_front = mi.Frame3f.cos_theta(hit.wi) > 0
            return dr.select(from_front, *(side(hit, active) for side in sides))

        return lookup

    def of_both(name: str) -> Any:
        value = getattr(front, name)
        return value if value == getattr(back, name) else None

    return Material(
        front.bsdf,
        of_side("albedo"),
        of_side("roughness"),
        of_both("constant_roughness"),
        of_both("constant_albedo"),
        other_front=front,
    )


def children_of(bsdf: mi.BSDF) -> dict[str, mi.Object]:
    """The BSDFs and textures directly inside a BSDF, by parameter name."""
    children = {}

    class Collect(mi.TraversalCallback):  # type: ignore[misc]
        def put(self, name: str, value: object, *_: object) -> None:
            if isinstance(value, mi.Object):
                children[name] = value

    bsdf.traverse(Collect())
    return children


def colour(texture: mi.Texture | None) -> Lookup:
    """Of a texture, or white where there is none."""
    if texture is None:
        return lambda _hit, _active: mi.Color3f(1)
    return lambda hit, active: mi.Color3f(texture.eval(hit, _looked_up(active)))


def _looked_up(active: mi.Bool) -> mi.Bool:
    """Where a texture is read: on CUDA everywhere, since who asks takes only what is active.

    Dr.Jit 1.5 ends the process where a kernel that is recorded reads a texture of the GPU for some
    of its threads only (docs/upstream.md).
    """
    return mi.Bool(True) if mi.variant().startswith("cuda") else active


def _constant_colour(texture: mi.Texture | None) -> tuple[float, ...] | None:
    if texture is None:
        return (1.0, 1.0, 1.0)
    if texture.class_name() not in ("SRGBReflectanceSpectrum", "UniformSpectrum"):
        return None
    value = np.array(mi.traverse(texture)["value"], dtype=np.float64).reshape(-1)
    return tuple(np.broadcast_to(value, 3).tolist())


def _constant(value: float) -> tuple[Lookup, float | None]:
    return lambda _hit, _active: mi.Float(value), value


def _diffuse(_bsdf: mi.BSDF, _children: dict[str, mi.Object]) -> tuple[Lookup, float | None]:
    return _constant(1.0)


def _smooth(_bsdf: mi.BSDF, _children: dict[str, mi.Object]) -> tuple[Lookup, float | None]:
    return _constant(0.0)


def _rough(bsdf: mi.BSDF, children: dict[str, mi.Object]) -> tuple[Lookup, float | None]:
    """Alpha as a texture, two anisotropic ones (their mean), or a plain number."""
    names = [name for name in ("alpha", "alpha_u", "alpha_v") if name in children]
    if not names:
        parameters = mi.traverse(bsdf)
        return lambda _hit, _active: mi.Float(parameters["alpha"]), _number(parameters["alpha"])
    textures = [children[name] for name in names]

    def roughness(hit: mi.SurfaceInteraction3f, active: mi.Bool) -> mi.Float:
        here = _looked_up(active)
        return sum(texture.eval_1(hit, here) for texture in textures) / len(textures)

    return roughness, _mean_of_uniform(textures)


def _principled(_bsdf: mi.BSDF, children: dict[str, mi.Object]) -> tuple[Lookup, float | None]:
    """Disney's parametrisation: alpha is the square of the artist's roughness."""
    texture = children["roughness"]
    constant = _mean_of_uniform([texture])
    return (
        lambda hit, active: dr.square(texture.eval_1(hit, _looked_up(active))),
        None if constant is None else constant**2,
    )


def _mean_of_uniform(textures: list[mi.Texture]) -> float | None:
    if any(texture.class_name() != "UniformSpectrum" for texture in textures):
        return None
    return sum(_number(mi.traverse(texture)["value"]) for texture in textures) / len(textures)


def _number(value: mi.Float) -> float:
    return float(np.array(value).reshape(-1)[0])


_KINDS: dict[str, tuple[str, Callable[..., tuple[Lookup, float | None]]]] = {
    "SmoothDiffuse": ("reflectance", _diffuse),
    "SmoothConductor": ("specular_reflectance", _smooth),
    "RoughConductor": ("specular_reflectance", _rough),
    "SmoothDielectric": ("specular_transmittance", _smooth),
    "ThinDielectric": ("specular_transmittance", _smooth),
    "RoughDielectric": ("specular_transmittance", _rough),
    "SmoothPlastic": ("diffuse_reflectance", _smooth),
    "RoughPlastic": ("diffuse_reflectance", _rough),
    "Principled": ("base_color", _principled),
}
"""Class of the BSDF -> its texture that is the albedo (1 where it has none), and its roughness."""


def _plugins() -> list[str]:
    """The same, as scene files name them."""
    return [kind.removeprefix("Smooth").lower() for kind in _KINDS]
