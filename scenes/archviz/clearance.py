"""Checks that no piece can enter another, a wall or the camera, whatever the variables do.

A mover sweeps a convex region of the floor: the hull of its footprints at all angles and at the
corners of its range. Movers whose regions are apart (or that lie above one another) never meet.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from modelling.furniture import Parts
from rooms import HALF_X, HALF_Z, MOVERS, Mover, static_parts

ANGLES = 25
CAMERA = ((-2.6, 1.1, 1.75), (3.2, 1.9, 2.9))
"""The box of the camera's positions, in metres."""

Region = tuple[np.ndarray, float, float]
"""A convex polygon [n, 2] of x and z, counter-clockwise, and the heights it spans."""


def hull(points: np.ndarray) -> np.ndarray:
    """Convex hull [n, 2], counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(np.round(points, 6), axis=0)
    halves = []
    for sequence in (ordered, ordered[::-1]):
        chain: list[np.ndarray] = []
        for p in sequence:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-1] - chain[-2], p - chain[-2]
                if ax * by - ay * bx > 0:
                    break
                chain.pop()
            chain.append(p)
        halves += chain[:-1]
    return np.array(halves)


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest gap between two convex polygons along an edge's normal; negative if they overlap."""
    gaps = []
    for one, other in ((a, b), (b, a)):
        edge = np.roll(one, -1, axis=0) - one
        outward = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        support = np.einsum("ij,ij->i", outward, one)
        gaps.append(np.max(np.min(outward @ other.T, axis=1) - support))
    return max(gaps)


def swept(mover: Mover) -> list[Region]:
    """One region for each piece."""
    regions = []
    for parts in mover.pieces.values():
        points = np.concatenate([m.vertices for meshes in parts.values() for m in meshes])
        flat, corners = hull(points[:, [0, 2]]), []
        for angle in np.radians(mover.turn + np.linspace(*mover.turns, ANGLES)):
            c, s = np.cos(angle), np.sin(angle)
            turned = flat @ np.array([[c, -s], [s, c]])
            for dx, dz in product(*zip(mover.low, mover.high, strict=True)):
                corners.append(turned + np.array([mover.x + dx, mover.z + dz]))
        regions.append((hull(np.concatenate(corners)), points[:, 1].min(), points[:, 1].max()))
    return regions


def footprints(parts: Parts) -> list[Region]:
    """One region for each mesh."""
    return [
        (hull(mesh.vertices[:, [0, 2]]), mesh.vertices[:, 1].min(), mesh.vertices[:, 1].max())
        for meshes in parts.values()
        for mesh in meshes
    ]


def smallest_gap(one: list[Region], other: list[Region]) -> float:
    """In the plane, over pieces that share a height."""
    gaps = [apart(a[0], b[0]) for a in one for b in other if a[1] < b[2] and b[1] < a[2]]
    return min(gaps, default=np.inf)


def check(margin: float = 0.004) -> dict[str, float]:
    """Gaps in metres between all pairs; raises ValueError, with the names, for one below margin."""
    regions = {name: swept(mover) for name, mover in MOVERS.items()}
    gaps = {f"{a}, {b}": smallest_gap(regions[a], regions[b]) for a, b in combinations(regions, 2)}
    (x0, y0, z0), (x1, y1, z1) = CAMERA
    box = np.array([(x0, z0), (x1, z0), (x1, z1), (x0, z1)])
    gaps |= {f"{n}, camera": smallest_gap(r, [(box, y0, y1)]) - 0.15 for n, r in regions.items()}
    fixed = footprints(static_parts())
    for name, region in regions.items():
        gaps[f"{name}, room"] = smallest_gap(region, fixed)
        reach = np.abs(np.concatenate([polygon for polygon, _, _ in region])).max(axis=0)
        gaps[f"{name}, walls"] = min(np.array([HALF_X, HALF_Z]) - reach)
    for name, mover in MOVERS.items():
        if not mover.choices:
            gaps[f"within {name}"] = _among_themselves(mover)
    if bad := {pair: gap for pair, gap in gaps.items() if gap < margin}:
        raise ValueError(f"these come too near to each other (metres): {bad}")
    return gaps


def _among_themselves(mover: Mover) -> float:
    """Gap between what stands on a table that moves: it is the same in every pose."""
    pieces = [[r for r in footprints(parts) if r[1] > 0.3] for parts in mover.pieces.values()]
    return min((smallest_gap(a, b) for a, b in combinations(pieces, 2)), default=np.inf)
