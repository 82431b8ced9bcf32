"""Caustics: the light that mirrors and glass throw onto surfaces, by photon mapping (Jensen 1996).

Photons start on the specular surfaces, where an emitter is seen from there, and follow the same
chains as camera rays until they meet something that is not specular. Six pictures of the scene's
bounds, one for each direction that a surface can mainly face, hold the irradiance that arrives.
Their numbers come from one set of points, as those of direct light: no seed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from torch.quasirandom import SobolEngine

from ngi.machine.backend import dr, mi
from ngi.render.specular import ChainEnd, SpecularChain
from ngi.scene.variable_scene import VariableScene

PHOTONS = 2**12

CELLS = 128
"""Of a picture's finest level, along the longest side of the scene's bounds."""

LEVELS = 5
"""Each has cells twice as wide as the one before."""

MAX_BOUNCES = 6
"""What is longer is mostly light that cannot leave a body, and a third of the work."""

ENOUGH_PHOTONS = 16
"""In a cell and its neighbours, for its own irradiance to count and not that of coarser cells: as
many of equal power as have the same relative variance.
"""

TOLERANCE = 8
"""Cells between a surface and the light of its picture, beyond which it is another surface's."""

_RESOLUTION = 2.0**-20
"""Of the sums over photons, which are sums of integers: in any order the same."""

_BRIGHTEST = 1e4
"""Irradiance that one photon adds at most."""

_CHANNELS = 5
"""Irradiance in R, G and B; of its mean over them the sum of squares, and times the depth."""


class Mirror:
    """A shape with a specular BSDF, and the instance that shows it, if any."""

    def __init__(self, shape: mi.Shape, instance: mi.Shape | None) -> None:
        self._shape = shape
        self._instance = None if instance is None else mi.traverse(instance)
        # A mesh makes its table of areas at the first use, which a recording would trip over.
        dr.eval(shape.sample_position(0, mi.Point2f(0.5)))

    def sample(
        self, numbers: mi.Point2f, active: mi.Bool
    ) -> tuple[mi.Point3f, mi.Normal3f, mi.Float]:
        """A place on it, the normal there, and the density by area."""
        sample = self._shape.sample_position(0, numbers, active)
        if self._instance is None:
            return sample.p, sample.n, sample.pdf
        to_world = self._instance["to_world"]
        normal = to_world @ sample.n
        stretch = dr.abs(dr.det(mi.Matrix3f(to_world.matrix))) * dr.norm(normal)
        return to_world @ sample.p, dr.normalize(normal), sample.pdf / stretch


@dataclass(frozen=True)
class Caustics:
    """Traces the photons of a scene.

    chain: what they follow. mirrors: where they start, at least one.
    bounds: the scene's corners with the least and the greatest coordinates.
    """

    chain: SpecularChain
    mirrors: list[Mirror]
    bounds: tuple[tuple[float, ...], tuple[float, ...]]

    def pictures(self, scene: mi.Scene, photons: Sequence[mi.Float]) -> mi.Float:
        """[6 * CELLS * CELLS * 4] irradiance in R, G and B, and depth in cells, for `radiance`.

        photons: of `photon_points`.
        """
        end, power = self._trace(scene, photons)
        sums = [dr.zeros(mi.Int64, 6 * CELLS * CELLS) for _ in range(_CHANNELS)]
        picture, x, y, depth = self._place(end.hit)
        x, y = mi.Int32(dr.floor(x)), mi.Int32(dr.floor(y))
        active = (
            _is_diffuse(end.hit)
            & (dr.max(power) > 0)
            & (x >= 0)
            & (x < CELLS)
            & (y >= 0)
            & (y < CELLS)
        )
        index = mi.UInt32((picture * CELLS + y) * CELLS + x)
        irradiance = dr.minimum(power / self._cell**2, _BRIGHTEST)
        mean = dr.mean(irradiance)
        for total, value in zip(sums, (*irradiance, dr.square(mean), mean * depth), strict=True):
            dr.scatter_add(total, mi.Int64(dr.round(value / _RESOLUTION)), index, active)
        dr.eval(sums)
        return _resolved([mi.Float(total) * _RESOLUTION for total in sums])

    def radiance(self, pictures: mi.Float, hit: mi.SurfaceInteraction3f) -> mi.Color3f:
        """Linear radiance that leaves the diffuse part of a hit's BSDF because of caustics."""
        picture, x, y, depth = self._place(hit)
        active = _is_diffuse(hit)
        irradiance = mi.Color3f(0)
        for column, row, weight in _bilinear(x, y):
            inside = (column >= 0) & (column < CELLS) & (row >= 0) & (row < CELLS)
            index = mi.UInt32((picture * CELLS + row) * CELLS + column)
            value = dr.gather(mi.Vector4f, pictures, index, active & inside)
            near = dr.abs(value.w - depth) < TOLERANCE
            irradiance += dr.select(near, weight * mi.Color3f(value.x, value.y, value.z), 0)
        facing = dr.max(dr.abs(hit.n))  # a cell holds more of a surface that is turned away
        reflectance = hit.bsdf().eval_diffuse_reflectance(hit, active)
        return dr.select(active, irradiance * facing * reflectance / dr.pi, 0)

    def _trace(self, scene: mi.Scene, photons: Sequence[mi.Float]) -> tuple[ChainEnd, mi.Color3f]:
        """Where photons end, and their power; zero for one that met nothing specular."""
        which, *numbers = photons
        count, wanted = len(self.mirrors), dr.width(which)
        chosen = dr.minimum(mi.UInt32(which * count), count - 1)
        start, density = dr.zeros(mi.SurfaceInteraction3f, wanted), mi.Float(0)
        for number, mirror in enumerate(self.mirrors):
            here = chosen == number
            point, normal, there = mirror.sample(mi.Point2f(numbers[0], numbers[1]), here)
            start.p = dr.select(here, point, start.p)
            start.n = dr.select(here, normal, start.n)
            density = dr.select(here, there, density)
        towards, irradiance = scene.sample_emitter_direction(
            start, mi.Point2f(numbers[2], numbers[3]), True
        )
        power = irradiance * dr.abs(dr.dot(start.n, towards.d)) * count / (density * wanted)
        power = dr.select((density > 0) & (towards.pdf > 0), power, 0)
        ray = start.spawn_ray(towards.d)  # off the surface, and back onto it
        ray.d = -towards.d
        end = self.chain.follow(scene, ray)
        return end, dr.select(end.segments > 1, power * end.throughput, 0)

    @property
    def _cell(self) -> float:
        low, high = map(np.array, self.bounds)
        return float((high - low).max() / CELLS)

    def _place(self, hit: mi.SurfaceInteraction3f) -> tuple[mi.Int32, mi.Float, mi.Float, mi.Float]:
        """Number of the picture, and column, row and depth there, all in cells."""
        x, y, z = (hit.p - mi.Point3f(*self.bounds[0])) / self._cell
        normal = dr.mulsign(mi.Normal3f(hit.n), dr.dot(hit.n, hit.to_world(hit.wi)))
        steep = dr.abs(normal)
        along_x = (steep.x >= steep.y) & (steep.x >= steep.z)
        along_y = ~along_x & (steep.y >= steep.z)
        axis = dr.select(along_x, mi.Int32(0), dr.select(along_y, 1, 2))
        main = dr.select(along_x, normal.x, dr.select(along_y, normal.y, normal.z))
        return (
            2 * axis + dr.select(main > 0, mi.Int32(1), 0),
            dr.select(along_x, y, x),
            dr.select(along_x | along_y, z, y),
            dr.select(along_x, x, dr.select(along_y, y, z)),
        )


def caustics_of(scene: VariableScene, chain: SpecularChain) -> Caustics | None:
    """None where no shape carries one of the chain's BSDFs, or the scene's paths are too short."""
    bounces = min(chain.maximum_bounces, MAX_BOUNCES)
    if chain.longest_path >= 0:  # of a caustic, one vertex is the surface that it falls on
        bounces = min(bounces, chain.longest_path - 2)
    specular = [surface.material.bsdf for surface in chain.surfaces]
    mirrors = [Mirror(*placed) for placed in scene.placed() if placed[0].bsdf() in specular]
    if not mirrors or bounces < 1:
        return None
    return Caustics(replace(chain, maximum_bounces=bounces), mirrors, scene.description.bounds)


def photon_points() -> list[mi.Float]:
    """Five numbers in [0, 1) for each of `PHOTONS`: the shape, the place on it, and that on the
    emitters; a Sobol sequence (Joe and Kuo 2008), shifted to its cells' middle.
    """
    points = SobolEngine(5).draw(PHOTONS).double().numpy() + 0.5 / PHOTONS
    numbers = [mi.Float(column) for column in points.T]
    dr.eval(numbers)
    return numbers


def _is_diffuse(hit: mi.SurfaceInteraction3f) -> mi.Bool:
    return hit.is_valid() & mi.has_flag(hit.bsdf().flags(), mi.BSDFFlags.DiffuseReflection)


def _bilinear(x: mi.Float, y: mi.Float) -> list[tuple[mi.Int32, mi.Int32, mi.Float]]:
    """Column, row and weight of the four cells whose centres surround a place."""
    left, top = dr.floor(x - 0.5), dr.floor(y - 0.5)
    right_share, low_share = x - 0.5 - left, y - 0.5 - top
    return [
        (
            mi.Int32(left) + i,
            mi.Int32(top) + j,
            (right_share if i else 1 - right_share) * (low_share if j else 1 - low_share),
        )
        for i in (0, 1)
        for j in (0, 1)
    ]


def _resolved(sums: list[mi.Float]) -> mi.Float:
    """Of each cell the finest level at which enough photons have arrived, blended with the next."""
    levels = [sums]
    for level in range(1, LEVELS):
        cells = CELLS >> level
        index = dr.arange(mi.UInt32, 6 * cells * cells)
        column, row, picture = index % cells, index // cells % cells, index // (cells * cells)
        first = (picture * cells * 2 + row * 2) * cells * 2 + column * 2
        corners = [first, first + 1, first + cells * 2, first + cells * 2 + 1]
        finer = levels[-1]
        coarse = [sum(dr.gather(mi.Float, total, corner) for corner in corners) for total in finer]
        levels.append(coarse)
        dr.eval(levels[-1])
    index = dr.arange(mi.UInt32, 6 * CELLS * CELLS)
    column, row, picture = index % CELLS, index // CELLS % CELLS, index // (CELLS * CELLS)
    light, depth, photons = mi.Color3f(0), mi.Float(-2 * CELLS), mi.Float(0)
    for level in reversed(range(LEVELS)):
        values = _interpolated(levels[level], picture, column, row, level)
        total = mi.Color3f(values[:3])
        mean = dr.mean(total)
        # What is expected of this level: chosen by what it has, too much light would be found.
        enough = 1 if level == LEVELS - 1 else dr.clip(2 * photons / ENOUGH_PHOTONS - 1, 0, 1)
        photons = dr.square(mean) / dr.maximum(values[3], _RESOLUTION)  # a quarter of four cells'
        light = dr.lerp(light, total / 4**level, enough)
        depth = dr.select(mean > 0, values[4] / mean, depth)
    packed = dr.zeros(mi.Float, 4 * 6 * CELLS * CELLS)
    dr.scatter(packed, mi.Vector4f(*light, depth), index)
    return packed


def _interpolated(
    totals: list[mi.Float], picture: mi.UInt32, column: mi.UInt32, row: mi.UInt32, level: int
) -> list[mi.Float]:
    """Between a level's cells, at the centres of those of the finest level."""
    cells = CELLS >> level
    x, y = ((mi.Float(place) + 0.5) / 2**level for place in (column, row))
    result = [mi.Float(0) for _ in totals]
    for i, j, weight in _bilinear(x, y):
        i, j = (dr.clip(place, 0, cells - 1) for place in (i, j))
        index = mi.UInt32((mi.Int32(picture) * cells + j) * cells + i)
        for k, total in enumerate(totals):
            result[k] = result[k] + weight * dr.gather(mi.Float, total, index)
    return result
