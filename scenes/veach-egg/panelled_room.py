"""The panelled room of Veach Egg: wainscot, mouldings, table, wall lamp and pictures.

Lengths are metres. The room spans x in [-1.9, 1.9], y in [0, 2.5], z in [-1.75, 2.2].
"""

from __future__ import annotations

import numpy as np
from modelling.meshes import Mesh, box, grained, lathe, sweep, tube

HALF_WIDTH, HEIGHT, BACK, FRONT = 1.9, 2.5, -1.75, 2.2
WAINSCOT = 1.28
"""Height of the panelling with its cap."""
TIERS = ((0.2, 0.52), (0.62, 1.15))
"""Bottom and top of the lower and upper panels."""
WOOD = 1.2
"""Extent of the wood's image."""

TABLE = (0.05, -1.08)
"""x and z of the axis of the table."""
TABLE_RADIUS, TABLE_HEIGHT = 0.6, 0.72
SCONCE = (0.95, 1.68, -1.56)
"""Centre of the wall lamp's bowl, 2 cm below its bulb."""
PICTURE = (-0.3, 1.74, 0.34, 0.25)
"""Centre x and y, half width and half height of the picture above the panelling."""
MOULDING = [(0.0, 0.004), (0.0, 0.014), (0.012, 0.024), (0.03, 0.02), (0.042, 0.028), (0.046, 0.0)]


def fielded_panel(x0: float, x1: float, y0: float, y1: float) -> Mesh:
    """A board with a raised, bevelled field, before the plane z = 0."""
    base = box((x0, y0, 0.0), (x1, y1, 0.004)).vertices
    bevel, middle = 0.055, np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    front = base[:, 2] > 0
    inward = np.sign(middle - base[:, :2])
    field = base[front] + np.column_stack([bevel * inward[front], np.full(front.sum(), 0.02)])
    edge = np.array([0, 2, 3, 1])  # of the four front corners, in the order of box()
    low, high = base[front][edge], field[edge]
    vertices = np.concatenate([low, high])
    faces = [(4, 5, 6), (4, 6, 7)]
    for a in range(4):
        b = (a + 1) % 4
        faces += [(a, b, 4 + b), (a, 4 + b, 4 + a)]
    return Mesh(vertices, np.array(faces))


def panelling(width: float, columns: int) -> list[Mesh]:
    """A wainscot before the plane z = 0, facing +z, centred on x = 0."""
    half, stile, depth = width / 2, 0.05, 0.034
    edges = np.linspace(-half, half, columns + 1)
    heights = [0.0, *[y for tier in TIERS for y in tier], WAINSCOT - 0.04]
    parts = [
        grained(box((-half, low, 0), (half, high, depth)), "x", WOOD)
        for low, high in zip(heights[::2], heights[1::2], strict=True)
    ]
    for low, high in TIERS:
        for x in edges:
            post = box((max(x - stile, -half), low, 0), (min(x + stile, half), high, depth))
            parts.append(grained(post, "y", WOOD))
        for a, b in zip(edges[:-1] + stile, edges[1:] - stile, strict=True):
            parts.append(grained(fielded_panel(a, b, low, high), "y", WOOD))
    cap = [(WAINSCOT - 0.04, 0.042), (WAINSCOT - 0.02, 0.058)]
    parts += [grained(box((-half, y, 0), (half, y + 0.02, z)), "x", WOOD) for y, z in cap]
    return [*parts, grained(box((-half, 0, depth), (half, 0.13, depth + 0.014)), "x", WOOD)]


def wainscot() -> list[Mesh]:
    """Along all four walls."""
    depth = FRONT - BACK
    middle = (FRONT + BACK) / 2
    across, along = panelling(2 * HALF_WIDTH, 6), panelling(depth, 6)
    return [
        *[part.moved(z=BACK) for part in across],
        *[part.rotated("y", 180).moved(z=FRONT) for part in across],
        *[part.rotated("y", 90).moved(x=-HALF_WIDTH, z=middle) for part in along],
        *[part.rotated("y", -90).moved(x=HALF_WIDTH, z=middle) for part in along],
    ]


def cornice() -> list[Mesh]:
    outline = np.array(
        [(-HALF_WIDTH, BACK), (HALF_WIDTH, BACK), (HALF_WIDTH, FRONT), (-HALF_WIDTH, FRONT)]
    )
    profile = [(0.0, 0.09), (-0.015, 0.09), (-0.03, 0.06), (-0.07, 0.03), (-0.08, 0.0)]
    ring = sweep(outline, profile)  # in x and y, forward along z; to x and z, downward along y
    return [Mesh(ring.vertices[:, [0, 2, 1]] * [1, -1, 1] + [0, HEIGHT, 0], ring.faces)]


def table() -> tuple[list[Mesh], list[Mesh]]:
    """A round pedestal table: its top with the grain along x, and the turned foot."""
    r, y = TABLE_RADIUS, TABLE_HEIGHT
    profile = [
        (0, y - 0.03),
        (r - 0.02, y - 0.03),
        (r - 0.006, y - 0.027),
        (r, y - 0.018),
        (r, y - 0.012),
    ]
    profile += [(r - 0.004, y - 0.003), (r - 0.01, y), (0.5 * r, y), (0, y)]
    top = lathe(profile, 72)
    planar = Mesh(top.vertices, top.faces, top.normals, top.vertices[:, [2, 0]] / WOOD + 0.5)
    column = [(0.07, 0.1), (0.075, 0.13), (0.045, 0.16), (0.04, 0.22), (0.062, 0.32), (0.066, 0.38)]
    column += [(0.05, 0.47), (0.036, 0.54), (0.036, 0.6), (0.06, 0.63), (0.15, 0.66), (0.16, 0.688)]
    bend = np.array([(0.05, 0.14), (0.12, 0.15), (0.2, 0.11), (0.28, 0.045), (0.34, 0.024)])
    feet = []
    for turn in (30.0, 150.0, 270.0):
        path = np.column_stack([bend, np.zeros(len(bend))])
        feet.append(tube(path, np.array([0.032, 0.03, 0.026, 0.023, 0.022])).rotated("y", turn))
    x, z = TABLE
    return [planar.moved(x, 0, z)], [part.moved(x, 0, z) for part in [lathe(column, 32), *feet]]


def wall_lamp() -> list[Mesh]:
    """A bowl that shines upwards on an arm; the bulb, a disk of radius 0.1, almost fills it."""
    bowl = [
        (0, -0.07),
        (0.03, -0.068),
        (0.075, -0.05),
        (0.105, -0.015),
        (0.118, 0.03),
        (0.121, 0.03),
    ]
    bowl = [*bowl[:-1], (0.115, 0.031), (0.1, -0.01), (0.07, -0.042), (0.03, -0.058), (0, -0.06)]
    x, y, z = SCONCE
    arm = np.array(
        [
            (x, y - 0.068, z),
            (x, y - 0.1, z - 0.02),
            (x, y - 0.13, z - 0.08),
            (x, y - 0.12, BACK + 0.01),
        ]
    )
    rose = lathe([(0, 0), (0.055, 0), (0.055, 0.008), (0.03, 0.018), (0, 0.02)], 32)
    return [
        lathe(bowl, 40).moved(x, y, z),
        tube(arm, 0.011),
        rose.rotated("x", 90).moved(x, y - 0.12, BACK + 0.001),
    ]
