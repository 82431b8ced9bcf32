"""What a specular BSDF does to a ray that meets it: a direction, and a weight.

The same physics as Mitsuba's BSDFs, but where those would choose between reflection and refraction
at random, they are told apart by which is the stronger; a slightly rough BSDF is taken for a smooth
one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ngi.machine.backend import dr, mi
from ngi.render.materials import Material, children_of, colour

Branch = tuple[Any, Any]
"""Direction in a hit's shading frame: Vector3f, and weight of the radiance that comes from there:
Color3f."""

Bounce = Callable[..., tuple[Branch, Branch]]
"""(hit: SurfaceInteraction3f, active: Bool, photons: bool) -> the stronger branch, and the other
one, which has no weight where there is none. photons: weights are of the flux that is carried on,
which refraction does not scale as it scales radiance (Veach 1997, Sec. 5.2)."""


@dataclass(frozen=True)
class SpecularSurface:
    """A BSDF that is specular where its roughness is small.

    two_sided: whether it acts on rays from behind too; if not, it is black to them.
    branches: how many directions the radiance comes from.
    """

    material: Material
    bounce: Bounce
    two_sided: bool
    branches: int


def specular_surface(material: Material) -> SpecularSurface | None:
    """None for what has no single direction: diffuse and plastic BSDFs, bump and normal maps."""
    bsdf, two_sided = material.bsdf, False
    if bsdf.class_name() == "TwoSidedBRDF":
        sides = children_of(bsdf)
        bsdf = sides["brdf_0"]
        two_sided = sides.get("brdf_1", bsdf) == bsdf
    kind = bsdf.class_name()
    if kind in ("SmoothConductor", "RoughConductor"):
        return SpecularSurface(material, _conductor(bsdf), two_sided, branches=1)
    if kind in _DIELECTRICS:
        return SpecularSurface(material, _DIELECTRICS[kind](bsdf), two_sided=True, branches=2)
    return None


def _conductor(bsdf: mi.BSDF) -> Bounce:
    children = children_of(bsdf)
    reflectance = colour(children.get("specular_reflectance"))
    index, absorption = colour(children["eta"]), colour(children["k"])

    def bounce(
        hit: mi.SurfaceInteraction3f,
        active: mi.Bool,
        photons: bool,  # noqa: ARG001 - a mirror reflects both alike
    ) -> tuple[Branch, Branch]:
        cosine = dr.abs(mi.Frame3f.cos_theta(hit.wi))
        channels = zip(index(hit, active), absorption(hit, active), strict=True)
        fresnel = [mi.fresnel_conductor(cosine, mi.Complex2f(n, k)) for n, k in channels]
        reflected = mi.reflect(hit.wi)
        weight = mi.Color3f(*fresnel) * reflectance(hit, active)
        return (reflected, weight), (reflected, mi.Color3f(0))

    return bounce


def _dielectric(bsdf: mi.BSDF) -> Bounce:
    """Reflection and refraction.

    Refraction scales the radiance by the square of the relative index, as in Mitsuba: entering and
    leaving a body cancel.
    """

    def branches(hit: mi.SurfaceInteraction3f) -> tuple[mi.Float, mi.Vector3f, mi.Float]:
        cosine = mi.Frame3f.cos_theta(hit.wi)
        reflected, refracted_cosine, _, ratio = mi.fresnel(cosine, index())
        return reflected, mi.refract(hit.wi, refracted_cosine, ratio), dr.square(ratio)

    index = _index(bsdf)
    return _by_strength(bsdf, branches)


def _thin_dielectric(bsdf: mi.BSDF) -> Bounce:
    """Reflection, with all that goes to and fro inside the sheet, and straight on."""

    def branches(hit: mi.SurfaceInteraction3f) -> tuple[mi.Float, mi.Vector3f, mi.Float]:
        reflected = mi.fresnel(dr.abs(mi.Frame3f.cos_theta(hit.wi)), index())[0]
        return 2 * reflected / (1 + reflected), -hit.wi, mi.Float(1)

    index = _index(bsdf)
    return _by_strength(bsdf, branches)


def _by_strength(
    bsdf: mi.BSDF,
    branches: Callable[[mi.SurfaceInteraction3f], tuple[mi.Float, mi.Vector3f, mi.Float]],
) -> Bounce:
    """branches: hit -> reflected share, direction of what passes, factor on its radiance."""
    children = children_of(bsdf)
    reflectance = colour(children.get("specular_reflectance"))
    transmittance = colour(children.get("specular_transmittance"))

    def bounce(
        hit: mi.SurfaceInteraction3f, active: mi.Bool, photons: bool
    ) -> tuple[Branch, Branch]:
        share, through, factor = branches(hit)
        reflected = mi.reflect(hit.wi), share * reflectance(hit, active)
        passed = (1 - share) if photons else (1 - share) * factor
        passing = through, passed * transmittance(hit, active)
        reflects = share > 0.5
        return dr.select(reflects, reflected, passing), dr.select(reflects, passing, reflected)

    return bounce


def _index(bsdf: mi.BSDF) -> Callable[[], mi.Float]:
    """Refractive index of the inside relative to the outside, as it is at present."""
    parameters = mi.traverse(bsdf)
    return lambda: mi.Float(parameters["eta"])


_DIELECTRICS: dict[str, Callable[[mi.BSDF], Bounce]] = {
    "SmoothDielectric": _dielectric,
    "RoughDielectric": _dielectric,
    "ThinDielectric": _thin_dielectric,
}
