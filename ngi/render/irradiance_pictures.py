"""Irradiance from photons, in six pictures of a scene's bounds (photon mapping, Jensen 1996).

There is one picture for each direction that a surface can mainly face. Where few photons arrive,
wider cells count. The sums over photons are sums of integers: in any order the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ngi.machine.backend import dr, mi

CELLS = 128
"""Of a picture's finest level, along the longest side of the bounds."""

LEVELS = 5
"""Each has cells twice as wide as the one before."""

ENOUGH_PHOTONS = 16
"""In a cell and its neighbours, for its own irradiance to count and not that of coarser cells: as
many of equal power as have the same relative variance.
"""

TOLERANCE = 8
"""Cells between a surface and the light of its picture, beyond which it is another surface's."""

_RESOLUTION = 2.0**-32
_RESOLUTION_OF_SQUARES = 2.0**-44
"""Of the sums over photons, in units of the brightest one: a 100,000th as bright counts alike,
and 2^18 of the brightest in one cell are not too many for 64 bits.
"""

_NO_LIGHT = 1e-30
"""Irradiance of the brightest photon where none arrives."""


@dataclass(frozen=True)
class IrradiancePictures:
    """Makes and reads the pictures; a picture's number, columns and rows count in cells.

    bounds: the scene's corners with the least and the greatest coordinates.
    """

    bounds: tuple[tuple[float, ...], tuple[float, ...]]

    def of_photons(self, hit: mi.SurfaceInteraction3f, power: mi.Color3f) -> mi.Float:
        """[6 * CELLS * CELLS * 4] irradiance in R, G and B, and depth in cells.

        hit: where each photon arrives. power: 0 for those that do not count.
        """
        picture, x, y, depth = self._place(hit)
        column, row = mi.Int32(dr.floor(x)), mi.Int32(dr.floor(y))
        active = (dr.max(power) > 0) & dr.isfinite(dr.max(power)) & _inside(column, row)
        index = mi.UInt32((picture * CELLS + row) * CELLS + column)
        light = power / self._cell**2
        dr.eval(light, active, index, depth)  # together, or photons are traced twice
        unit = dr.maximum(dr.max(dr.select(active, dr.max(light), 0)), _NO_LIGHT)
        light /= unit
        mean = dr.mean(light)
        values = (*light, mean * depth, dr.square(mean))
        steps = (*4 * (_RESOLUTION,), _RESOLUTION_OF_SQUARES)
        sums = [dr.zeros(mi.UInt64, 6 * CELLS * CELLS) for _ in values]
        for total, value, step in zip(sums, values, steps, strict=True):
            number = mi.Int64(dr.round(value / step))
            # CUDA adds none with a sign. A copy per thread, the default, would be 63 MB to clear.
            dr.scatter_add(total, mi.UInt64(number), index, active, dr.ReduceMode.Local)
        dr.eval(sums)
        scaled = zip(sums, steps, strict=True)
        return _resolved([mi.Float(mi.Int64(total)) * step for total, step in scaled], unit)

    def dark(self) -> mi.Float:
        """As `of_photons` where none arrives."""
        pictures = dr.zeros(mi.Float, 6 * CELLS * CELLS * 4)
        dr.make_opaque(pictures)
        return pictures

    def irradiance(self, pictures: mi.Float, hit: mi.SurfaceInteraction3f) -> mi.Color3f:
        """On the side of the surface that the ray has met."""
        picture, x, y, depth = self._place(hit)
        light = mi.Color3f(0)
        for column, row, weight in _bilinear(x, y):
            index = mi.UInt32((picture * CELLS + row) * CELLS + column)
            here = hit.is_valid() & _inside(column, row)
            value = dr.gather(mi.Vector4f, pictures, index, here)
            near = dr.abs(value.w - depth) < TOLERANCE
            light += dr.select(near, weight * mi.Color3f(value.x, value.y, value.z), 0)
        return light * dr.max(dr.abs(hit.n))  # a cell holds more of a surface at an angle to it

    @property
    def _cell(self) -> float:
        """Width."""
        low, high = map(np.array, self.bounds)
        return float((high - low).max() / CELLS)

    def _place(self, hit: mi.SurfaceInteraction3f) -> tuple[mi.Int32, mi.Float, mi.Float, mi.Float]:
        """Number of the picture, and column, row and depth there."""
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


def _resolved(sums: list[mi.Float], unit: mi.Float) -> mi.Float:
    """Of each cell the finest level at which enough photons have arrived, blended with the next.

    sums: irradiance in R, G and B, its mean over them times the depth, and the mean's squares.
    unit: of irradiance in the sums.
    """
    levels = [_Level.of(*sums)]
    for level in range(1, LEVELS):
        levels.append(levels[-1].coarser(CELLS >> level))
    index, picture, row, column = _cells(CELLS)
    light, depth, photons = mi.Color3f(0), mi.Float(-2 * CELLS), mi.Float(0)
    for level in reversed(range(LEVELS)):
        *total, deep, squares = levels[level].interpolated(picture, column, row, level)
        mean = dr.mean(mi.Color3f(total))
        # What is expected of this level: chosen by what it has, too much light would be found.
        enough = 1 if level == LEVELS - 1 else dr.clip(2 * photons / ENOUGH_PHOTONS - 1, 0, 1)
        squares = dr.maximum(squares, _RESOLUTION_OF_SQUARES)
        photons = dr.square(mean) / squares  # as in four finer cells
        light = dr.lerp(light, mi.Color3f(total) / 4**level, enough)
        depth = dr.select(mean > 0, deep / mean, depth)
    packed = dr.zeros(mi.Float, 4 * 6 * CELLS * CELLS)
    dr.scatter(packed, mi.Vector4f(*(light * unit), depth), index)
    return packed


@dataclass(frozen=True)
class _Level:
    """Sums over the photons of each cell.

    first: four of them, side by side, so that a cell's are read at once. last: the fifth.
    """

    first: mi.Float
    last: mi.Float

    @classmethod
    def of(cls, *sums: mi.Float) -> _Level:
        level = cls(dr.ravel(mi.Vector4f(*sums[:4])), mi.Float(sums[4]))
        dr.eval(level.first, level.last)
        return level

    def at(self, cell: mi.UInt32) -> tuple[mi.Float, ...]:
        return *dr.gather(mi.Vector4f, self.first, cell), dr.gather(mi.Float, self.last, cell)

    def coarser(self, cells: int) -> _Level:
        """Sums over the four cells that are one of this many a row."""
        _, picture, row, column = _cells(cells)
        corner = (picture * cells * 2 + row * 2) * cells * 2 + column * 2
        four = [self.at(corner + step) for step in (0, 1, cells * 2, cells * 2 + 1)]
        return _Level.of(*(sum(values) for values in zip(*four, strict=True)))

    def interpolated(
        self, picture: mi.UInt32, column: mi.UInt32, row: mi.UInt32, level: int
    ) -> tuple[mi.Float, ...]:
        """Between the level's cells, at the centres of those of the finest level."""
        cells = CELLS >> level
        if level == 0:
            return self.at((picture * cells + row) * cells + column)
        result: tuple[mi.Float, ...] = (mi.Float(0),) * 5
        x, y = ((mi.Float(place) + 0.5) / 2**level for place in (column, row))
        for i, j, weight in _bilinear(x, y):
            i, j = (dr.clip(place, 0, cells - 1) for place in (i, j))
            here = self.at(mi.UInt32((mi.Int32(picture) * cells + j) * cells + i))
            result = tuple(a + weight * b for a, b in zip(result, here, strict=True))
        return result


def _cells(count: int) -> tuple[mi.UInt32, mi.UInt32, mi.UInt32, mi.UInt32]:
    """Index, picture, row and column of every cell; count: of columns."""
    index = dr.arange(mi.UInt32, 6 * count * count)
    return index, index // (count * count), index // count % count, index % count


def _bilinear(x: mi.Float, y: mi.Float) -> list[tuple[mi.Int32, mi.Int32, mi.Float]]:
    """Column, row and weight of the four cells whose centres surround a place."""
    left, top = dr.floor(x - 0.5), dr.floor(y - 0.5)
    to_right, down = x - 0.5 - left, y - 0.5 - top
    return [
        (mi.Int32(left) + i, mi.Int32(top) + j, across * along)
        for i, across in ((0, 1 - to_right), (1, to_right))
        for j, along in ((0, 1 - down), (1, down))
    ]


def _inside(column: mi.Int32, row: mi.Int32) -> mi.Bool:
    return (column >= 0) & (column < CELLS) & (row >= 0) & (row < CELLS)
