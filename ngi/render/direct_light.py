"""Direct light: what a surface sends towards the camera of the light that emitters send to it.

The estimator is that of Mitsuba's `direct` integrator, one emitter sample and one BSDF sample
combined by multiple importance sampling (Veach and Guibas 1995, power heuristic), but its numbers
come from one set of points for every pixel: no noise between pixels, and no seed. Every camera ray
takes one of the points: of 16 rays the error is about half that of 16 random paths.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from torch.quasirandom import SobolEngine

from ngi.machine.backend import dr, mi
from ngi.patches import BufferLayout
from ngi.render.tracing import stratified


def emission(scene: mi.Scene, hit: mi.SurfaceInteraction3f) -> mi.Color3f:
    """Linear radiance emitted back along the ray, the environment's where the ray misses."""
    emitter = hit.emitter(scene)
    if emitter is None:  # in a scalar variant
        return mi.Color3f(0)
    return mi.Color3f(emitter.eval(hit))


_SOBOL_DIMENSIONS = (1, 2, 3, 4, 5)
_ONE = np.ones(1)

MOST_RAYS = 64
"""Per pixel, that many emitters ask for by themselves; of more, some have none."""

_LEAST_DENSITY = 1e-30
"""What is divided by where a density is 0, so that nothing becomes NaN."""


def light_points(count: int, emitters: NDArray[np.float64] = _ONE) -> NDArray[np.float64]:
    """[count, 6] points that go with `ngi.render.tracing.subpixel_points`: five numbers in the unit
    hypercube, which are the lobe of the BSDF, the place on the emitters, and the direction within
    the lobe; and the weight of the emitter sample.

    The points of a pixel are the number of the point and the first dimension of a Sobol sequence
    (a Hammersley set); these are later dimensions of it (Joe and Kuo 2008), `stratified` as well.
    16 of them have one point in every elementary interval of each pair that is used together, and
    of each dimension together with the number of the point.

    Each emitter has a whole number of points, at least one, the same in all pixels: by itself an
    emitter of probability 0.1 would be as bright as 2 of 16 points make it. The weight is what its
    probability is of its share of the points. With fewer points than emitters, some of
    which then have none, it is 1.

    emitters: [e] probability with which each is chosen, see `emitter_probabilities`
    """
    sobol = SobolEngine(max(_SOBOL_DIMENSIONS) + 1).draw(count).numpy()
    points = stratified(sobol[:, _SOBOL_DIMENSIONS])
    if not 1 < np.count_nonzero(emitters) <= count:
        return np.column_stack([points, np.ones(count)])
    shares = _shares(emitters, count)
    chosen = np.repeat(np.arange(len(emitters)), shares)
    within = np.concatenate([(np.arange(share) + 0.5) / share for share in shares if share])
    place = (np.cumsum(emitters) - emitters)[chosen] + emitters[chosen] * within
    weight = count * emitters[chosen] / shares[chosen]
    order = points[:, 1].argsort()
    points[order, 1] = place
    return np.column_stack([points, weight[order.argsort()]])


def emitter_probabilities(scene: mi.Scene) -> NDArray[np.float64]:
    """[e], with which `scene.sample_emitter_direction` chooses each; one of 1 where none is."""
    weights = np.array([float(emitter.sampling_weight()) for emitter in scene.emitters()])
    return weights / weights.sum() if weights.sum() > 0 else _ONE


def fewest_rays(scene: mi.Scene, layout: BufferLayout) -> int:
    """Per pixel: one for each emitter that direct light in the buffers is asked of, as far as
    `MOST_RAYS` go.
    """
    if "direct" not in layout.names:
        return 1
    return min(int(np.count_nonzero(emitter_probabilities(scene))), MOST_RAYS)


def _shares(emitters: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """[e]: how many of `count` points each gets, by largest remainders; one at least."""
    exact, least = count * emitters, emitters > 0
    shares = np.maximum(np.floor(exact), least)
    while shares.sum() < count:
        shares[np.argmax(exact - shares)] += 1
    while shares.sum() > count:
        shares[np.argmax(np.where(shares > least, shares - exact, -np.inf))] -= 1
    return shares.astype(np.int64)


def direct_light(
    scene: mi.Scene, hit: mi.SurfaceInteraction3f, point: Sequence[mi.Float]
) -> mi.Color3f:
    """Linear radiance that leaves a hit against its ray after one bounce from an emitter.

    hit: a miss gives zero. point: of `light_points`.

    What a mirror or smooth glass shows of an emitter counts; of several lobes one is chosen.
    """
    if mi.variant().startswith("scalar") and not hit.is_valid():
        return mi.Color3f(0)  # asking a miss for its BSDF would crash
    lobe, *numbers, emitter_weight = point
    active, bsdf, context = hit.is_valid(), hit.bsdf(), mi.BSDFContext()
    towards, irradiance = scene.sample_emitter_direction(
        hit, mi.Point2f(numbers[0], numbers[1]), True, active
    )
    sampled = active & (towards.pdf > 0)
    value, density, sample, weight = bsdf.eval_pdf_sample(
        context, hit, hit.to_local(towards.d), lobe, mi.Point2f(numbers[2], numbers[3]), active
    )
    share = dr.select(towards.delta, 1, _share(towards.pdf, density))
    by_emitter = value * irradiance * share * emitter_weight
    scattered = active & (sample.pdf > 0)
    ray = hit.spawn_ray(hit.to_world(sample.wo))
    met = scene.ray_intersect_preliminary(ray, False, scattered)
    scattered = scattered & _may_emit(met)
    lit = met.compute_surface_interaction(ray, mi.RayFlags.All, scattered)
    by_bsdf = weight * _seen(scene, hit, lit, sample, scattered)
    return dr.select(sampled, by_emitter, 0) + dr.select(scattered, by_bsdf, 0)


def _seen(
    scene: mi.Scene,
    hit: mi.SurfaceInteraction3f,
    lit: mi.SurfaceInteraction3f,
    sample: mi.BSDFSample3f,
    active: mi.Bool,
) -> mi.Color3f:
    """What an emitter that the BSDF sample meets sends, times the sample's share."""
    emitter = lit.emitter(scene, active)
    if emitter is None:  # in a scalar variant
        return mi.Color3f(0)
    density = scene.pdf_emitter_direction(hit, mi.DirectionSample3f(scene, lit, hit), active)
    delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
    return emitter.eval(lit, active) * dr.select(delta, 1, _share(sample.pdf, density))


def _may_emit(met: mi.PreliminaryIntersection3f) -> mi.Bool:
    """Where a ray meets an emitter, or nothing but the environment; the rest need not be known."""
    if met.shape is None:  # in a scalar variant
        return mi.Bool(True)
    return dr.select(met.is_valid(), met.shape.is_emitter(), True)


def _share(density: mi.Float, other: mi.Float) -> mi.Float:
    """The power heuristic's weight of a sample drawn with `density`."""
    ratio = other / dr.maximum(density, _LEAST_DENSITY)
    return 1 / (1 + ratio * ratio)
