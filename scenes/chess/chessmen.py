"""The six kinds of chessmen, turned and carved; each stands on y = 0 about the origin, in metres.

White men face -z as modelled; black ones are turned by their instance.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from modelling.meshes import Mesh, lathe, rounded_box, sphere, surface
from modelling.ornaments import rounded_profile

Profile = list[tuple[float, float]]

KINDS = ("pawn", "rook", "knight", "bishop", "queen", "king")
BASE_RADIUS = {
    "pawn": 0.0145,
    "rook": 0.0165,
    "knight": 0.0175,
    "bishop": 0.0165,
    "queen": 0.018,
    "king": 0.0185,
}
SEGMENTS = 32


def turned_body(kind: str, stem: Profile) -> Mesh:
    """A base of the kind's radius and above it the given stem, both in millimetres."""
    r = 1000 * BASE_RADIUS[kind]
    base = [(0, 0), (0.97 * r, 0), (1.02 * r, 1.5), (r, 5), (0.93 * r, 6.2), (0.86 * r, 6.8)]
    base += [(0.9 * r, 8), (0.84 * r, 10.5), (0.66 * r, 13)]
    return lathe([tuple(p) for p in rounded_profile(base + stem, 2) / 1000], SEGMENTS)


def collar(radius: float, height: float) -> Profile:
    """A thin ring that bulges to a radius, 3.4 high; millimetres."""
    return [(0.62 * radius, height), (radius, height + 0.8), (radius, height + 2.2)]


def pawn() -> list[Mesh]:
    stem = [(7, 17), (5.2, 24), (4.6, 31), *collar(9, 33), (5, 36.6), (4, 38)]
    return [turned_body("pawn", [*stem, (0, 38)]), sphere(0.0083, 24).moved(0, 0.0445)]


def rook() -> list[Mesh]:
    stem = [(9.4, 18), (8.2, 26), (7.8, 36), *collar(11.2, 38.5), (9.4, 42), (10.4, 45)]
    stem += [(11.6, 48), (11.8, 49.5), (11, 50), (0, 50)]
    return [turned_body("rook", stem), *(merlon(60 * i) for i in range(6))]


def merlon(turn: float) -> Mesh:
    """One tooth of the battlement: a sixth of a ring with a gap, rounded by its normals."""
    inner, outer, low, high = 0.0075, 0.0115, 0.0493, 0.0562
    section = [(inner, low), (outer, low), (outer, high), (inner, high), (inner, low)]
    angle = np.radians(np.linspace(-20, 20, 7))
    corners = np.array([p for a, b in pairwise(section) for p in (a, b)])
    points = np.stack(
        [
            corners[:, 0][None] * np.cos(angle)[:, None],
            np.broadcast_to(corners[:, 1], (len(angle), len(corners))),
            -corners[:, 0][None] * np.sin(angle)[:, None],
        ],
        axis=-1,
    )
    middle = corners.mean(axis=0)
    ends = []
    for ring in (0, -1):
        a = angle[ring]
        hub = (middle[0] * np.cos(a), middle[1], -middle[0] * np.sin(a))
        ends.append(np.broadcast_to(hub, points[0].shape))
    points = np.stack([ends[0], points[0], *points, points[-1], ends[1]])
    mesh = surface(points)
    corner = mesh.vertices[mesh.faces]
    return Mesh(corner.reshape(-1, 3), np.arange(3 * len(corner)).reshape(-1, 3)).rotated("y", turn)


def bishop() -> list[Mesh]:
    stem = [(7.6, 18), (5.6, 28), (4.8, 42), *collar(9.8, 45), (5.6, 49), (5, 50.5), (4.4, 51)]
    return [turned_body("bishop", [*stem, (0, 51)]), mitre(), sphere(0.0027, 16).moved(0, 0.0735)]


def mitre() -> Mesh:
    """A drop with a slanting cut."""
    profile = rounded_profile(
        [(0.1, 50), (6, 51), (9, 56), (8.2, 62), (4.6, 68.5), (1.4, 72), (0.1, 72)], 2
    )
    length = np.linspace(0, len(profile) - 1, 44)
    index = np.arange(len(profile))
    radius = np.interp(length, index, profile[:, 0]) / 1000
    height = np.interp(length, index, profile[:, 1]) / 1000
    radius[[0, -1]] = 0
    angle = np.append(np.linspace(0, 2 * np.pi, 53)[:-1], 0.0)
    y = np.broadcast_to(height[:, None], (len(height), len(angle)))
    x, z = radius[:, None] * np.cos(angle), -radius[:, None] * np.sin(angle)
    depth = 0.72 * (y - 0.0615) - 0.69 * (-z - 0.001)
    cut = np.clip(1.6 - np.abs(depth) / 0.0006, 0, 1) * (-z > -0.001)
    shrink = 1 - 0.42 * cut
    return surface(np.stack([x * shrink, y, z * shrink], axis=-1)).rotated("y", -70)


def queen() -> list[Mesh]:
    stem = [(8.6, 19), (6.4, 32), (5.2, 52), *collar(11, 55), (6.8, 58.8), *collar(8.6, 59.6)]
    stem += [(6, 63.4), (6.6, 68), (9.6, 76), (10.4, 78), (8, 76.5), (0, 78)]
    points = [sphere(0.0019, 10).moved(0.0096, 0.0778).rotated("y", 40 * i) for i in range(9)]
    dome = lathe([(0.0076, 0.076), (0.0066, 0.0795), (0.004, 0.082), (0, 0.083)], 32)
    return [turned_body("queen", stem), *points, dome, sphere(0.0031, 16).moved(0, 0.085)]


def king() -> list[Mesh]:
    stem = [(9, 19), (6.8, 33), (5.6, 57), *collar(11.6, 60), (7, 63.8), *collar(9, 64.6)]
    stem += [(6.4, 68.4), (7, 73), (10, 81), (10.2, 82.4), (9, 83.4), (4.5, 86.5), (2, 87.5)]
    cross = [
        rounded_box((-0.0019, 0.0865, -0.0016), (0.0019, 0.1, 0.0016), 0.0007, 2),
        rounded_box((-0.0052, 0.0922, -0.0016), (0.0052, 0.0956, 0.0016), 0.0007, 2),
    ]
    return [turned_body("king", [*stem, (0, 87.5)]), *cross]


def spindle(path: Profile, across: list[float], thick: list[float], segments: int = 18) -> Mesh:
    """A body along a path of (forward, height), millimetres; its sections are ellipses.

    across: half width in the plane of the path; thick: half width in x; at every point.
    """
    widths = list(zip(across, thick, strict=True))
    p = np.column_stack([rounded_profile(path, 2), rounded_profile(widths, 2)]) / 1000
    tangent = np.gradient(p[:, :2], axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    angle = np.append(np.linspace(0, 2 * np.pi, segments + 1)[:-1], 0.0)
    side = p[:, None, 2] * np.cos(angle)
    forward = p[:, None, 0] + side * tangent[:, None, 1]
    height = p[:, None, 1] - side * tangent[:, None, 0]
    points = np.stack([p[:, None, 3] * np.sin(angle), height, -forward], axis=-1)
    ends = [np.broadcast_to((0, p[i, 1], -p[i, 0]), points[0].shape) for i in (0, -1)]
    return surface(np.concatenate([ends[:1], points, ends[1:]]))


def knight() -> list[Mesh]:
    """A horse's head on a turned base."""
    plinth = turned_body("knight", [(11, 16), (12, 18), (11.6, 20), (9, 21), (0, 21)])
    neck = spindle(
        [(0.5, 18), (-1, 26), (-3.5, 36), (-3, 47), (1.5, 55), (5, 57)],
        [10.5, 10, 9.2, 8.2, 6.4, 3.5],
        [8.5, 7.6, 6.6, 5.6, 4.8, 3],
    )
    head = spindle(
        [(-2, 55.5), (2.5, 53.5), (8, 48.5), (12.5, 43), (14.8, 39.8)],
        [3, 6.6, 5.6, 4, 2.2],
        [2.6, 5.2, 4.6, 3.9, 2.4],
    )
    mane = spindle(
        [(-9.5, 26), (-12.6, 36), (-11.8, 47), (-6.5, 56.5), (0, 61.5)],
        [1.2, 2.4, 2.8, 2.6, 0.8],
        [1.2, 2.2, 2.4, 2.2, 0.8],
    )
    ears = [
        spindle([(-0.5, 57), (0.3, 62), (1.6, 66.5)], [2.2, 1.9, 0.2], [1.6, 1.3, 0.2], 12).moved(x)
        for x in (-0.0027, 0.0027)
    ]
    return [plinth, neck, head, mane, *ears]


MAKERS = {"pawn": pawn, "rook": rook, "knight": knight, "bishop": bishop, "queen": queen}
MAKERS["king"] = king
