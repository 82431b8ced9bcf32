"""Things in the living room: bottle, glass, bowl, plants, lamp, television, shelf and books.

Unless said otherwise a thing stands on y = 0 about the origin.
"""

from __future__ import annotations

import numpy as np
from living_textures import BOOKS
from modelling.furniture import Parts, rod, splayed_legs
from modelling.meshes import Mesh, box, lathe, rounded_box, sphere, surface, tube
from modelling.textures import hash_noise

WATER_LEVEL = 0.150
"""Height of the water in the bottle, metres."""


def smooth(mesh: Mesh) -> Mesh:
    """Without texture coordinates, so that it can be written together with others."""
    return Mesh(mesh.vertices, mesh.faces, mesh.normals)


def faceted(mesh: Mesh) -> Mesh:
    """Every triangle with corners and a normal of its own: a sharp-edged part among smooth ones."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces, np.repeat(normals, 3, axis=0))


def noise(index: int, salt: int) -> float:
    """In [0, 1)."""
    return float(hash_noise(np.array([index]), np.array([salt]))[0])


BOTTLE_INSIDE = [
    (0.0, 0.022), (0.012, 0.020), (0.024, 0.014), (0.031, 0.010), (0.0345, 0.012), (0.0362, 0.018),
    (0.0362, 0.08), (0.0362, WATER_LEVEL), (0.0362, 0.165), (0.035, 0.178), (0.030, 0.192),
    (0.021, 0.207), (0.0145, 0.219), (0.0115, 0.232), (0.0105, 0.26), (0.0105, 0.2995),
]  # fmt: skip
"""(radius, height) of the cavity, from the dimple in its bottom up to the mouth."""

BOTTLE_OUTSIDE = [
    (0.0, 0.012), (0.014, 0.010), (0.027, 0.002), (0.031, 0.0006), (0.035, 0.0012),
    (0.0382, 0.004), (0.0395, 0.009), (0.0395, 0.08), (0.0395, 0.166), (0.0382, 0.180),
    (0.033, 0.195), (0.024, 0.210), (0.0175, 0.222), (0.0148, 0.234), (0.0135, 0.262),
    (0.0135, 0.276), (0.0158, 0.278), (0.0162, 0.284), (0.0158, 0.290), (0.0137, 0.292),
    (0.0137, 0.2985), (0.0125, 0.3005), (0.0111, 0.3005),
]  # fmt: skip


def bottle() -> tuple[Mesh, Mesh, Mesh, Mesh]:
    """The glass's outside, its inside below and above the water, and the water's top.

    All normals point to the optically outer side as scene.xml names it: from the glass to the air
    of the room, from the cavity to the glass, from the water up.
    """
    level = next(i for i, (_, height) in enumerate(BOTTLE_INSIDE) if height >= WATER_LEVEL)
    radius = BOTTLE_INSIDE[level][0]
    outside = lathe([*BOTTLE_OUTSIDE, BOTTLE_INSIDE[-1]], 64)
    wet = lathe(BOTTLE_INSIDE[: level + 1], 64)
    dry = lathe(BOTTLE_INSIDE[level:], 64)
    top = lathe([(radius, WATER_LEVEL), (radius / 2, WATER_LEVEL), (0, WATER_LEVEL)], 64)
    return smooth(outside), smooth(wet), smooth(dry), smooth(top)


def tumbler() -> Mesh:
    """A drinking glass with a thick bottom, one closed surface."""
    profile = [
        (0.0, 0.001), (0.026, 0.001), (0.029, 0.003), (0.030, 0.008), (0.035, 0.092),
        (0.0345, 0.094), (0.0335, 0.094), (0.033, 0.092), (0.0282, 0.018), (0.026, 0.0145),
        (0.015, 0.0135), (0.0, 0.013),
    ]  # fmt: skip
    return smooth(lathe(profile, 48))


def bowl() -> Mesh:
    profile = [
        (0.0, 0.002), (0.055, 0.002), (0.058, 0.006), (0.085, 0.022), (0.115, 0.05), (0.132, 0.082),
        (0.1335, 0.085), (0.1315, 0.0865), (0.129, 0.084), (0.111, 0.053), (0.082, 0.028),
        (0.05, 0.013), (0.0, 0.011),
    ]  # fmt: skip
    return smooth(lathe(profile, 40))


def fruit(x: float, y: float, z: float, radius: float) -> Mesh:
    return smooth(sphere(radius, 20).scaled(1, 0.93, 1).moved(x, y, z))


def vase(height: float, belly: float) -> Mesh:
    t = np.linspace(0, 1, 15)
    radius = belly * (0.55 + 0.75 * np.sin(np.pi * t**0.8) ** 1.5 * (1 - 0.45 * t))
    lip = [(radius[-1] * 0.8, height), (radius[-1] * 0.75, height * 0.7), (0, height * 0.7)]
    return smooth(
        lathe([(0, 0.001), *zip(radius, t * (height - 0.002) + 0.001, strict=True), *lip])
    )


def leaf(length: float, width: float, droop: float) -> Mesh:
    """Along +x from the origin, bending down by `droop` radians, folded a little at its rib."""
    t, u = np.meshgrid(np.linspace(0, 1, 7), np.linspace(-1, 1, 5), indexing="ij")
    angle = 0.5 * droop - droop * t
    x = length * np.cumsum(np.cos(angle), axis=0) / 7
    y = length * np.cumsum(np.sin(angle), axis=0) / 7
    half = 0.5 * width * np.sin(np.pi * (0.04 + 0.96 * t) ** 0.85) ** 0.7
    points = np.stack([x, y + 0.35 * half * np.abs(u), -u * half], axis=-1)
    return smooth(surface(points[::-1]))


def plant(height: float, leaves: int, seed: int, size: float = 0.27) -> Parts:
    """A rubber plant in a pot: stems with big leaves all around."""
    stems, foliage = [], []
    for stem in range(3):
        lean, turn = 0.05 + 0.07 * noise(stem, seed), 2.1 * stem + noise(stem, seed + 1)
        t = np.linspace(0, 1, 7)[:, None]
        tip = height * (1 - 0.16 * stem)
        outward = np.array([np.cos(turn), 0, np.sin(turn)])
        path = (0.04 + lean * tip * t**1.5) * outward
        path[:, 1] = 0.3 + (tip - 0.3) * t[:, 0]
        stems.append(smooth(tube(path, np.linspace(0.011, 0.005, 7), 6)))
        for i in range(leaves):
            share = 0.3 + 0.7 * i / (leaves - 1)
            at = np.array([np.interp(share, t[:, 0], path[:, k]) for k in range(3)])
            scale = (1.15 - 0.5 * share) * (0.85 + 0.3 * noise(i, seed + 7 * stem))
            blade = leaf(size * scale, 0.42 * size * scale, 1.1).rotated("z", 12 + 48 * share)
            turned = blade.rotated("y", 137.5 * i + 70 * stem + 30 * noise(i, seed + 3))
            foliage.append(turned.moved(*at))
    pot = [(0.0, 0.001), (0.13, 0.001), (0.135, 0.006), (0.165, 0.29), (0.167, 0.3), (0.16, 0.302),
           (0.153, 0.298), (0.149, 0.262), (0.147, 0.26), (0.0, 0.268)]  # fmt: skip
    return {"stem": stems, "foliage": foliage, "ceramic": [smooth(lathe(pot, 40))]}


def floor_lamp(height: float) -> list[Mesh]:
    """A brass stand; the globe, a sphere in scene.xml, rests on its cup."""
    foot = [(0, 0.001), (0.14, 0.001), (0.142, 0.006), (0.138, 0.016), (0.02, 0.024), (0.012, 0.03),
            (0.0, 0.03)]  # fmt: skip
    cup = [(0.0, 0.0), (0.012, 0.002), (0.04, 0.014), (0.062, 0.036), (0.064, 0.04), (0.0, 0.03)]
    stem = rod((0, 0.028, 0), (0, height + 0.004, 0), 0.011, 0.011, segments=16)
    return [smooth(lathe(foot, 40)), smooth(stem), smooth(lathe(cup, 32).moved(0, height, 0))]


def television(width: float, height: float, bottom: float) -> list[Mesh]:
    """Bezel, back and feet; its screen, a rectangle in scene.xml, closes the front at z = 0."""
    x, y0, y1, rim = width / 2, bottom, bottom + height, 0.008
    parts = [
        box((-x - rim, y0 - 0.014, -0.03), (x + rim, y1 + rim, -0.002)),
        box((-x - rim, y0 - 0.014, -0.001), (x + rim, y0, 0.003)),
        box((-x - rim, y1, -0.001), (x + rim, y1 + rim, 0.003)),
        box((-x - rim, y0, -0.001), (-x, y1, 0.003)),
        box((x, y0, -0.001), (x + rim, y1, 0.003)),
    ]
    for side in (-0.62 * x, 0.62 * x):
        parts.append(box((side - 0.012, 0.004, -0.02), (side + 0.012, y0 - 0.0145, -0.01)))
        parts.append(box((side - 0.014, 0.001, -0.11), (side + 0.014, 0.0095, 0.09)))
    return [faceted(part) for part in parts]


def shelf(width: float, height: float, depth: float, boards: list[float]) -> list[Mesh]:
    """Sides, back and boards at the given heights; the back stands at z = 0."""
    x, thick = width / 2, 0.025
    parts = [
        box((-x, 0.002, 0), (-x + thick, height, depth)),
        box((x - thick, 0.002, 0), (x, height, depth)),
        box((-x + thick + 0.001, 0.003, 0.001), (x - thick - 0.001, height - 0.001, 0.011)),
    ]
    for board in boards:
        left, right = -x + thick + 0.001, x - thick - 0.001
        parts.append(box((left, board, 0.012), (right, board + thick, depth - 0.004)))
    return [faceted(part) for part in parts]


def book(low: tuple[float, float, float], high: tuple[float, float, float], number: int) -> Mesh:
    """A book whose spine faces +z; its colour and title are column `number` of the image."""
    part = faceted(box(low, high))
    share = (part.vertices - np.array(low)) / (np.array(high) - np.array(low))
    spine = part.normals[:, 2] > 0.9
    u = (number % BOOKS + np.where(spine, 0.08 + 0.84 * share[:, 0], 0.5)) / BOOKS
    v = np.where(spine, 1 - share[:, 1], 0.97)
    return Mesh(part.vertices, part.faces, part.normals, np.stack([u, v], axis=-1))


def row_of_books(left: float, right: float, y: float, front: float, seed: int) -> list[Mesh]:
    """Books side by side from left to about right, their spines near z = front."""
    books, x, i = [], left, 0
    while True:
        thick = 0.018 + 0.034 * noise(i, seed) ** 1.5
        if x + thick > right:
            return books
        height = 0.19 + 0.09 * noise(i, seed + 1)
        depth = 0.14 + 0.05 * noise(i, seed + 2)
        z = front - 0.012 * noise(i, seed + 3)
        number = int(BOOKS * noise(i, seed + 4))
        books.append(book((x, y + 0.001, z - depth), (x + thick, y + height, z), number))
        x, i = x + thick + 0.0015, i + 1


def book_pile(sizes: list[tuple[float, float, float]], numbers: list[int]) -> list[Mesh]:
    """Books lying on one another, each a little turned."""
    pile, y = [], 0.001
    for i, ((width, thick, depth), number) in enumerate(zip(sizes, numbers, strict=True)):
        low, high = (-width / 2, 0, -depth / 2), (width / 2, thick, depth / 2)
        pile.append(book(low, high, number).rotated("y", 16 * noise(i, 91) - 8).moved(0, y, 0))
        y += thick + 0.001
    return pile


def coffee_table(length: float, depth: float, height: float) -> tuple[Mesh, list[Mesh]]:
    """The top, its wood's image laid once over it with the grain along x, and the underframe."""
    x, z = length / 2, depth / 2
    top = rounded_box((-x, height - 0.032, -z), (x, height, z), 0.006, 2)
    texture = np.stack([top.vertices[:, 2] / depth, top.vertices[:, 0] / length], axis=-1) + 0.5
    low, high, inset = height - 0.085, height - 0.033, 0.09
    frame = [
        box((-x + inset, low, middle - 0.012), (x - inset, high, middle + 0.012))
        for middle in (z - inset, inset - z)
    ]
    legs = splayed_legs(x - 0.08, z - 0.08, height - 0.033, 0.04, 0.02)
    feet = [leg.moved(0, 0.009, 0) for leg in legs]
    return Mesh(top.vertices, top.faces, top.normals, texture), [*frame, *feet]
