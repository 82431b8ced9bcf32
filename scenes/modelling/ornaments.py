"""Small things of a living room: teapot, vases, plants, books, curtains, panelling.

As in furniture.py, every piece stands on the plane y = 0 about the origin, in metres.
"""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts, rod, smooth_bar
from modelling.meshes import Mesh, box, lathe, sphere, surface, tube

FRAME = [(0.0, 0.0), (0.0, 0.022), (0.012, 0.026), (0.026, 0.016), (0.03, 0.0)]
"""Profile of picture frames: distances from the inner edge and from the wall."""

PANEL = [(0.0, 0.0), (0.004, 0.012), (0.014, 0.018), (0.024, 0.012), (0.034, 0.014), (0.04, 0.0)]
"""Profile of the mouldings of wall panels."""

VASES = {
    "bottle": [
        (0, 0),
        (0.06, 0),
        (0.085, 0.03),
        (0.095, 0.09),
        (0.075, 0.15),
        (0.03, 0.2),
        (0.022, 0.26),
        (0.024, 0.34),
        (0.032, 0.36),
        (0.025, 0.358),
        (0.015, 0.3),
        (0, 0.25),
    ],
    "amphora": [
        (0, 0),
        (0.045, 0),
        (0.05, 0.01),
        (0.085, 0.11),
        (0.105, 0.2),
        (0.095, 0.27),
        (0.06, 0.315),
        (0.052, 0.335),
        (0.07, 0.36),
        (0.06, 0.357),
        (0.04, 0.33),
        (0, 0.2),
    ],
    "drum": [
        (0, 0),
        (0.07, 0),
        (0.078, 0.008),
        (0.08, 0.02),
        (0.08, 0.2),
        (0.078, 0.212),
        (0.07, 0.22),
        (0.066, 0.21),
        (0.066, 0.05),
        (0, 0.045),
    ],
}
"""Profiles: (radius, height) from the bottom, over the rim, to the inside."""


def rounded_profile(corners: list[tuple[float, float]], rounds: int = 1) -> np.ndarray:
    """Corners cut off (Chaikin), which rounds a profile; its ends stay."""
    p = np.array(corners, dtype=float)
    for _ in range(rounds):
        cut = np.stack([0.75 * p[:-1] + 0.25 * p[1:], 0.25 * p[:-1] + 0.75 * p[1:]], axis=1)
        p = np.concatenate([p[:1], cut.reshape(-1, 2), p[-1:]])
    return p


def vase(kind: str) -> Mesh:
    return lathe(rounded_profile(VASES[kind]), 32)


def bowl(radius: float) -> Mesh:
    profile = [
        (0, 0),
        (0.4, 0),
        (0.42, 0.04),
        (0.8, 0.2),
        (1, 0.52),
        (0.96, 0.52),
        (0.74, 0.24),
        (0, 0.1),
    ]
    return lathe(rounded_profile([(radius * r, radius * h) for r, h in profile]), 36)


def fruit_bowl(radius: float) -> Parts:
    """A bowl with seven fruits that touch neither it nor each other."""
    fruits = [sphere(0.24 * radius, 18).scaled(1, 0.94, 1).moved(0, 0.37 * radius, 0)]
    for angle in np.radians(np.arange(6) * 60 + 10):
        x, z = 0.51 * radius * np.cos(angle), 0.51 * radius * np.sin(angle)
        fruits.append(sphere(0.235 * radius, 18).moved(x, 0.49 * radius, z))
    return {"ceramic": [bowl(radius)], "fruit": fruits}


def teapot() -> Parts:
    """0.21 from spout (+x) to handle (-x) and 0.15 high."""
    body = [
        (0, 0),
        (0.045, 0),
        (0.05, 0.006),
        (0.075, 0.04),
        (0.07, 0.085),
        (0.035, 0.112),
        (0.034, 0.116),
        (0, 0.117),
    ]
    lid = [
        (0, 0.118),
        (0.033, 0.118),
        (0.028, 0.127),
        (0.008, 0.132),
        (0.006, 0.137),
        (0.012, 0.145),
        (0.009, 0.152),
        (0, 0.154),
    ]
    spout = np.array(
        [
            (0.058, 0.038, 0),
            (0.082, 0.048, 0),
            (0.096, 0.075, 0),
            (0.104, 0.1, 0),
            (0.118, 0.112, 0),
        ]
    )
    handle = [
        (-0.056, 0.095, 0),
        (-0.085, 0.106, 0),
        (-0.112, 0.085, 0),
        (-0.105, 0.05, 0),
        (-0.066, 0.03, 0),
    ]
    return {
        "ceramic": [
            lathe(rounded_profile(body), 32),
            lathe(rounded_profile(lid), 24),
            tube(spout, np.array([0.02, 0.016, 0.011, 0.009, 0.008]), 14),
            smooth_bar(handle, 0.0065, 5),
        ]
    }


def cup() -> Mesh:
    """A bowl without handle, 0.06 high."""
    profile = [
        (0, 0),
        (0.02, 0),
        (0.022, 0.008),
        (0.036, 0.03),
        (0.04, 0.06),
        (0.037, 0.06),
        (0.032, 0.03),
        (0, 0.014),
    ]
    return lathe(rounded_profile(profile), 24)


def books(widths: list[float], thicknesses: list[float], turns: list[float]) -> Parts:
    """A stack of lying books; their covers take the materials book_0, book_1, book_2 in turn."""
    parts: Parts = {"paper": []}
    bottom = 0.0
    for i, (width, thick, turn) in enumerate(zip(widths, thicknesses, turns, strict=True)):
        w, d = width / 2, 0.36 * width
        boards = [
            box((-w, bottom, -d), (w, bottom + 0.003, d)),
            box((-w, bottom + thick - 0.003, -d), (w, bottom + thick, d)),
            box((-w, bottom + 0.003, -d), (-w + 0.004, bottom + thick - 0.003, d)),
        ]
        pages = box(
            (-w + 0.0045, bottom + 0.0035, 0.006 - d),
            (w - 0.006, bottom + thick - 0.0035, d - 0.006),
        )
        parts.setdefault(f"book_{i % 3}", []).extend(b.rotated("y", turn) for b in boards)
        parts["paper"].append(pages.rotated("y", turn))
        bottom += thick + 0.0005
    return parts


def leaf(length: float, width: float, lift: float, droop: float, turn: float) -> Mesh:
    """A folded, drooping blade that grows from the origin; lift and turn in degrees."""
    s, u = np.meshgrid(np.linspace(0, 1, 9), np.linspace(-1, 1, 5), indexing="ij")
    half = width / 2 * np.sin(np.pi * s**0.75) ** 0.8 + 0.002
    angle = np.radians(lift) - droop * s
    along, up = (np.cumsum(f(angle), axis=0) * length / 8 for f in (np.cos, np.sin))
    points = np.stack([u * half, up + 0.25 * half * np.abs(u), along], axis=-1)
    return surface(points - points[:1, 2:3]).rotated("y", turn)


def fig_tree(height: float, seed: int) -> Parts:
    """A pot, three bent stems and broad leaves; about 0.55 of its height wide."""
    random = np.random.Generator(np.random.PCG64(seed))
    pot = [
        (0, 0),
        (0.12, 0),
        (0.13, 0.01),
        (0.17, 0.3),
        (0.17, 0.32),
        (0.155, 0.32),
        (0.15, 0.28),
        (0, 0.28),
    ]
    soil = lathe([(0.148, 0.283), (0.1, 0.288), (0, 0.29)], 24)
    stems, leaves = [], []
    for stem in range(3):
        lean = np.radians(120 * stem + 40)
        s = np.linspace(0, 1, 12)
        reach = 0.04 + (0.1 + 0.02 * stem) * s**1.5
        top = height * (1 - 0.13 * stem) - 0.06
        path = np.stack([reach * np.cos(lean), 0.28 + (top - 0.28) * s, reach * np.sin(lean)], -1)
        stems.append(tube(path, np.linspace(0.012, 0.005, 12), 7))
        count = 15 - 2 * stem
        for i in range(count):
            place = 0.3 + 0.7 * (i + 0.5) / count
            at = [np.interp(place, s, path[:, k]) for k in range(3)]
            turn = 137.5 * i + 90 * stem + random.uniform(-15, 15)
            size = random.uniform(0.85, 1.1) * (0.36 - 0.12 * place) * height / 1.6
            blade = leaf(size, 0.58 * size, random.uniform(15, 50), 0.9, turn)
            leaves.append(blade.moved(*at))
    return {
        "pot": [lathe(rounded_profile(pot), 32)],
        "soil": [soil],
        "wood": stems,
        "leaf": leaves,
    }


def curtain(width: float, height: float, folds: int) -> Mesh:
    """A pleated sheet in the plane z = 0, from y = 0.01 to height, seen from both sides."""
    x, y = np.meshgrid(np.linspace(-1, 1, 10 * folds + 1), np.linspace(0, 1, 9))
    phase = np.pi * folds * (x + 0.03 * np.sin(7 * x + 3 * y))
    depth = 0.045 * np.sin(phase) * (1.05 - 0.35 * y) + 0.012 * np.sin(2.7 * phase + 2 * (1 - y))
    return surface(np.stack([x * width / 2, 0.01 + (height - 0.01) * y, depth], axis=-1))


def lamp_stand(height: float) -> Parts:
    """A foot, a stem and a cup that carries a globe of 0.17 radius centred 0.175 above it."""
    foot = lathe(
        [(0, 0.005), (0.14, 0.005), (0.142, 0.012), (0.135, 0.022), (0.02, 0.03), (0, 0.031)], 40
    )
    holder = lathe(
        [(0, height - 0.02), (0.02, height - 0.02), (0.05, height), (0, height + 0.004)], 24
    )
    return {"brass": [foot, rod((0, 0.02, 0), (0, height - 0.01, 0), 0.011), holder]}


def outline(left: float, bottom: float, right: float, top: float) -> np.ndarray:
    """Corners [4, 2], counter-clockwise."""
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)], dtype=float)
