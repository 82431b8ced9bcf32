"""Where in a box of targets a view leads."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

ROUNDING = 1e-9
"""Of a way, in its length."""
NEAREST = 1e-3
"""In lengths of a direction: nothing that is nearer is looked at from within a box."""

_CORNERS = np.array(list(product((False, True), repeat=3)))
_EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])


def nearest_target(direction: Vector, low: Vector, high: Vector) -> Vector:
    """The point of a box that a view leads through, or misses by the smallest angle.

    Of those that it leads through the one closest to the box's middle. A view that turns a little
    has it moved a little, flat boxes included.

    direction, low, high: [3], seen from where the view begins; so is the point
    """
    length = direction @ direction
    if length == 0:
        return np.clip(np.zeros(3), low, high)
    moving = direction != 0
    walls = np.stack([low, high])[:, moving] / direction[moving]
    enters, leaves = walls.min(axis=0).max(), walls.max(axis=0).min()
    passes = ((low <= 0) & (high >= 0))[~moving].all() and enters <= leaves + ROUNDING
    if passes and leaves > 0:
        middle = (low + high) / 2 @ direction / length
        along = np.clip(middle, max(enters, min(NEAREST, leaves)), leaves)
        return np.clip(along * direction, low, high)
    return _of_smallest_angle(direction, low, high)


def _of_smallest_angle(direction: Vector, low: Vector, high: Vector) -> Vector:
    """Of a box beside the view: on one of its edges, as only these are its outline."""
    corners = np.where(_CORNERS, high, low)
    begin, end = corners[_EDGES[:, 0]], corners[_EDGES[:, 1]]
    edge = end - begin
    # of points a + s e the cosine (a + s e)·d / |a + s e| is largest where s is
    # ((a·d)(a·e) - (e·d)(a·a)) / ((e·d)(a·e) - (a·d)(e·e))
    ad, ed = begin @ direction, edge @ direction
    aa, ae, ee = ((x * y).sum(axis=1) for x, y in ((begin, begin), (begin, edge), (edge, edge)))
    with np.errstate(divide="ignore", invalid="ignore"):
        within = np.nan_to_num(np.clip((ad * ae - ed * aa) / (ed * ae - ad * ee), 0, 1))
        points = np.concatenate([begin, begin + within[:, None] * edge, end])
        cosines = points @ direction / np.linalg.norm(points, axis=1)
    best: Vector = points[np.nan_to_num(cosines, nan=-np.inf).argmax()]
    return best
