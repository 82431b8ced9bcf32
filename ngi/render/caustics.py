"""Caustics: the light that mirrors and glass throw onto surfaces, by photon mapping (Jensen 1996).

Photons start on the specular surfaces, where an emitter is seen from there, and follow the same
chains as camera rays until they meet something that is not specular. Their numbers come from one
set of points, as those of direct light: no seed. Of point, spot and directional lights there are
caustics where the surface next to them is not perfectly smooth, as in Mitsuba's path tracer: no
path from the camera meets them by way of smooth glass or a smooth mirror.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

from torch.quasirandom import SobolEngine

from ngi.machine.backend import dr, mi
from ngi.render.irradiance_pictures import IrradiancePictures
from ngi.render.materials import Material, children_of, collect_materials, has_bsdf
from ngi.render.specular import SpecularChain
from ngi.scene.variable_scene import VariableScene

_logger = logging.getLogger(__name__)

PHOTONS = 2**12

MAX_BOUNCES = 6
"""What is longer is mostly light that cannot leave a body, and a third of the work."""


class Mirror:
    """A shape with a specular BSDF, and the instance that shows it, if any."""

    def __init__(self, shape: mi.Shape, instance: mi.Shape | None) -> None:
        self.shape = shape
        self._instance = None if instance is None else mi.traverse(instance)
        # A mesh makes its table of areas at the first use, which a recording would trip over.
        dr.eval(shape.sample_position(0, mi.Point2f(0.5)))

    def sample(
        self, numbers: mi.Point2f, active: mi.Bool
    ) -> tuple[mi.Point3f, mi.Normal3f, mi.Float]:
        """A place on it, the normal there, and the density by area."""
        sample = self.shape.sample_position(0, numbers, active)
        if self._instance is None:
            return sample.p, sample.n, sample.pdf
        to_world = self._instance["to_world"]
        normal = to_world @ sample.n
        stretch = dr.abs(dr.det(mi.Matrix3f(to_world.matrix))) * dr.norm(normal)
        return to_world @ sample.p, dr.normalize(normal), sample.pdf / stretch


@dataclass(frozen=True)
class Caustics:
    """Traces the photons of a scene.

    chain: what they follow. mirrors: where they start, at least one. principled: materials of that
        kind, or with such a side, whose albedo counts as that of a diffuse one.
    """

    chain: SpecularChain
    mirrors: list[Mirror]
    principled: list[Material]
    pictures: IrradiancePictures

    def trace(self, scene: mi.Scene, photons: Sequence[mi.Float]) -> mi.Float:
        """What `radiance` reads. photons: of `photon_points`."""
        which, *numbers = photons
        count, wanted = len(self.mirrors), dr.width(which)
        chosen = dr.minimum(mi.UInt32(which * count), count - 1)
        start, density = dr.zeros(mi.SurfaceInteraction3f, wanted), mi.Float(0)
        for number, mirror in enumerate(self.mirrors):
            here = chosen == number
            point, normal, there = mirror.sample(mi.Point2f(numbers[0], numbers[1]), here)
            start.p = dr.select(here, point, start.p)
            start.n = dr.select(here, normal, start.n)
            start.shape = dr.select(here, mi.ShapePtr(mirror.shape), start.shape)
            density = dr.select(here, there, density)
        towards, irradiance = scene.sample_emitter_direction(
            start, mi.Point2f(numbers[2], numbers[3]), True
        )
        power = irradiance * dr.abs(dr.dot(start.n, towards.d)) * count / (density * wanted)
        power = dr.select((density > 0) & (towards.pdf > 0), power, 0)
        power = dr.select(towards.delta & ~_is_rough(start.bsdf()), 0, power)
        ray = start.spawn_ray(towards.d)  # off the surface, and back onto it
        ray.d = -towards.d
        end = self.chain.follow(scene, ray, dr.max(power) > 0)
        counts = (end.segments > 1) & _is_diffuse(end.hit)  # it has met something specular
        return self.pictures.of_photons(end.hit, dr.select(counts, power * end.throughput, 0))

    def radiance(self, traced: mi.Float, hit: mi.SurfaceInteraction3f) -> mi.Color3f:
        """Linear radiance that leaves the diffuse part of a hit's BSDF because of caustics."""
        active = _is_diffuse(hit)
        # Where photons came from is not kept: as if from along the normal.
        along = mi.Vector3f(0, 0, dr.mulsign(mi.Float(1), mi.Frame3f.cos_theta(hit.wi)))
        scattered = hit.bsdf().eval(_diffuse_part(), hit, along, active)
        for material in self.principled:  # which have no part of their own
            here = has_bsdf(hit, material.bsdf, active)
            scattered = dr.select(here, material.albedo(hit, here) / dr.pi, scattered)
        irradiance = self.pictures.irradiance(traced, hit)
        return dr.select(active, irradiance * scattered, 0)


def caustics_of(scene: VariableScene, chain: SpecularChain) -> Caustics | None:
    """None where no shape carries one of the chain's BSDFs, where the scene's paths are too short,
    or all its emitters are points or directions and the chain's BSDFs smooth.
    """
    bounces = min(chain.maximum_bounces, MAX_BOUNCES)
    if chain.longest_path >= 0:  # of a caustic, one vertex is the surface that it falls on
        bounces = min(bounces, chain.longest_path - 2)
    specular = [surface.material.bsdf for surface in chain.surfaces]
    if all(map(_is_delta, scene.scene.emitters())):
        specular = list(filter(_is_rough, specular))
    mirrors = [
        mirror
        for shape, instance in scene.placed()
        if any(bsdf in specular for bsdf in scene.bsdfs_of(shape))
        and (mirror := _mirror(shape, instance)) is not None
    ]
    if not mirrors or bounces < 1:
        return None
    return Caustics(
        replace(chain, maximum_bounces=bounces, direct=False, photons=True),
        mirrors,
        collect_materials([each for each in scene.bsdfs() if _is_of_kind(each, "Principled")]),
        IrradiancePictures(scene.description.bounds),
    )


def photon_points() -> list[mi.Float]:
    """Five numbers in [0, 1) for each of `PHOTONS`: the shape, the place on it, and that on the
    emitters; a Sobol sequence (Joe and Kuo 2008), shifted to its cells' middle.
    """
    points = SobolEngine(5).draw(PHOTONS).double().numpy() + 0.5 / PHOTONS
    points = points[points[:, 0].argsort()]  # side by side, those of a shape take the same way
    # Copied into Dr.Jit's memory: how NumPy aligns its own is compiled into kernels, so that those
    # of one process would not be found again by the next.
    flat, every = mi.Float(points.ravel()), dr.arange(mi.UInt32, PHOTONS)
    numbers = [dr.gather(mi.Float, flat, 5 * every + dimension) for dimension in range(5)]
    dr.eval(numbers)
    return numbers


def _is_rough(bsdf: mi.BSDF) -> mi.Bool:
    """Whether it has a value: a smooth one's is a delta function."""
    return mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)


def _is_delta(emitter: mi.Emitter) -> bool:
    """Whether it is a point, or shines in one direction alone."""
    return bool(mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta))


def _mirror(shape: mi.Shape, instance: mi.Shape | None) -> Mirror | None:
    """None for what Mitsuba draws no points of, as curves."""
    try:
        return Mirror(shape, instance)
    except RuntimeError as error:
        _logger.warning("'%s' is left out of the caustics: %s", shape.id(), error)
        return None


def _is_of_kind(bsdf: mi.BSDF, kind: str) -> bool:
    """Whether it is, or one that it is made of."""
    children = [child for child in children_of(bsdf).values() if isinstance(child, mi.BSDF)]
    return bsdf.class_name() == kind or any(_is_of_kind(child, kind) for child in children)


def _diffuse_part() -> mi.BSDFContext:
    context = mi.BSDFContext()
    context.type_mask = int(mi.BSDFFlags.DiffuseReflection)
    return context


def _is_diffuse(hit: mi.SurfaceInteraction3f) -> mi.Bool:
    """Whether it scatters light on the side that the hit is on."""
    flags = hit.bsdf().flags()
    acts = (mi.Frame3f.cos_theta(hit.wi) > 0) | mi.has_flag(flags, mi.BSDFFlags.BackSide)
    return hit.is_valid() & acts & mi.has_flag(flags, mi.BSDFFlags.DiffuseReflection)
