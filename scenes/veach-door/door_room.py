"""The two rooms of Veach Door: walls, doorway, door, trim and furniture.

Lengths are metres. The dark room spans x in [-2.6, 2.6], y in [0, 2.6], z in [-2.5, 2.3]; the
bright room lies behind the wall z in [-2.64, -2.5], x in [-3.4, 2].
"""

from __future__ import annotations

import numpy as np
from modelling.meshes import Mesh, box, grained, lathe, rounded_box, sphere, sweep, tube, turned

LEFT, RIGHT, BACK, FRONT, TOP = -2.6, 2.6, -2.5, 2.3, 2.6
FAR, HALL_LEFT, HALL_RIGHT = -5.4, -3.4, 2.0
WALL = 0.14
OPENING = (-1.35, -0.45)
"""x of the hinge and of the other jamb."""
OPENING_HEIGHT = 2.05
DADO = 0.86
"""Height of the painted panelling."""
TABLE = (-0.25, 1.35, -0.78, 0.1)
"""x and z of the edges of the table top."""
TABLE_HEIGHT = 0.75
WINDOW = (0.35, 1.55, 1.0, 2.2)
"""x and y of the edges of the night window in the wall z = 2.3."""


def dividing_wall() -> list[Mesh]:
    """The wall between the rooms, with a hole that leaves 2 cm for the lining."""
    (x0, x1), z0, y = OPENING, BACK - WALL, OPENING_HEIGHT + 0.02
    return [
        box((HALL_LEFT, 0, z0), (x0 - 0.02, TOP, BACK)),
        box((x1 + 0.02, 0, z0), (RIGHT, TOP, BACK)),
        box((x0 - 0.02, y, z0), (x1 + 0.02, TOP, BACK)),
    ]


def door_frame() -> list[Mesh]:
    """The opening's lining, and on both sides of the wall an architrave."""
    (x0, x1), y, z0 = OPENING, OPENING_HEIGHT, BACK - WALL
    parts = [
        box((x0 - 0.02, 0, z0), (x0, y + 0.02, BACK)),
        box((x1, 0, z0), (x1 + 0.02, y + 0.02, BACK)),
        box((x0, y, z0), (x1, y + 0.02, BACK)),
    ]
    for low, high, thin in ((BACK, BACK + 0.022, 0.012), (z0 - 0.022, z0, 0.0)):
        gap = 0.004 + thin  # the door's hinge side needs some air
        parts += [
            box((x0 - gap - 0.09, 0, low), (x0 - gap, y + 0.1, high)),
            box((x1 + gap, 0, low), (x1 + gap + 0.09, y + 0.1, high)),
            box((x0 - gap, y + gap, low), (x1 + gap, y + 0.1, high)),
        ]
    return parts


def strip(bottom: float, top: float, depth: float) -> list[Mesh]:
    """A board along all walls of the dark room; below the lintel it leaves the doorway free."""
    x0, x1 = OPENING[0] - 0.107, OPENING[1] + 0.107
    behind = [((LEFT, x0)), (x1, RIGHT)] if bottom < OPENING_HEIGHT else [(LEFT, RIGHT)]
    parts = [box((a, bottom, BACK), (b, top, BACK + depth)) for a, b in behind]
    parts += [box((LEFT, bottom, FRONT - depth), (RIGHT, top, FRONT))]
    low, high = BACK + depth, FRONT - depth
    parts += [box((LEFT, bottom, low), (LEFT + depth, top, high))]
    return [*parts, box((RIGHT - depth, bottom, low), (RIGHT, top, high))]


def stiles() -> list[Mesh]:
    """Upright boards that divide the panelling on the back and side walls."""
    xs = [-2.2, -1.8, 0.1, 0.6, 1.1, 1.6, 2.1]
    low, high, depth = 0.16, DADO - 0.03, 0.018
    parts = [box((x - 0.04, low, BACK), (x + 0.04, high, BACK + depth)) for x in xs]
    for z in np.arange(-2.0, 2.2, 0.5):
        parts.append(box((LEFT, low, z - 0.04), (LEFT + depth, high, z + 0.04)))
        parts.append(box((RIGHT - depth, low, z - 0.04), (RIGHT, high, z + 0.04)))
    return parts


def door_leaf() -> list[Mesh]:
    """About the hinge, closed: x in [0.003, 0.896], z in [-0.04, 0]; six panels on each side."""
    (x0, x1), (y0, y1), depth = (0.003, 0.896), (0.008, 2.043), 0.04
    columns = [(x0 + 0.11, 0.405), (0.495, x1 - 0.11)]
    rows = [(0.22, 0.8), (0.95, 1.5), (1.6, 1.93)]
    ys = [y0, *[y for row in rows for y in row], y1]
    parts = [box((a, y0, -depth), (b, y1, 0)) for a, b in ((x0, 0.113), (0.786, x1))]
    parts += [
        box((0.113, a, -depth), (0.786, b, 0)) for a, b in zip(ys[::2], ys[1::2], strict=True)
    ]
    for low, high in rows:
        parts.append(box((0.405, low, -depth), (0.495, high, 0)))
        for a, b in columns:
            parts.append(box((a, low, -0.028), (b, high, -0.012)))
            parts += [box((a + 0.05, low + 0.05, z0), (b - 0.05, high - 0.05, z1))
                      for z0, z1 in ((-0.012, -0.005), (-0.035, -0.028))]  # fmt: skip
    return parts


def door_handles() -> list[Mesh]:
    """A knob with its rose on both faces of the door."""
    rose = [(0, 0), (0.03, 0), (0.03, 0.004), (0.022, 0.009), (0.011, 0.011), (0.01, 0.034)]
    knob = [(0.016, 0.04), (0.026, 0.049), (0.03, 0.06), (0.026, 0.071), (0.014, 0.078), (0, 0.08)]
    one = lathe(rose + knob, 32)
    front = one.rotated("x", 90).moved(0.84, 1.02, 0.0002)
    return [front, one.rotated("x", -90).moved(0.84, 1.02, -0.0402)]


def table() -> list[Mesh]:
    """A kitchen table of planed wood: four tapered legs, aprons and a thick top."""
    (x0, x1, z0, z1), under = TABLE, TABLE_HEIGHT - 0.034
    leg = turned([(0.024, 0), (0.038, 0.5), (0.046, under - 0.12), (0.046, under)], 4)
    parts = [grained(box((x0, under, z0), (x1, TABLE_HEIGHT, z1)), "x", 0.9)]
    for x in (x0 + 0.09, x1 - 0.09):
        parts += [grained(leg.moved(x=x, z=z), "y", 0.9) for z in (z0 + 0.09, z1 - 0.09)]
        parts.append(
            grained(box((x - 0.01, under - 0.1, z0 + 0.12), (x + 0.01, under, z1 - 0.12)), "z", 0.9)
        )
    for z in (z0 + 0.09, z1 - 0.09):
        parts.append(
            grained(box((x0 + 0.12, under - 0.1, z - 0.01), (x1 - 0.12, under, z + 0.01)), "x", 0.9)
        )
    return parts


def chair() -> list[Mesh]:
    """A ladder-back chair about the origin that looks along -x."""
    parts = [rounded_box((-0.21, 0.435, -0.21), (0.2, 0.465, 0.21), 0.012, 3)]
    for z in (-0.18, 0.18):
        parts.append(tube(np.array([(-0.19, 0, z), (-0.18, 0.44, z)]), np.array([0.014, 0.019])))
        back = np.array([(0.21, 0, z), (0.18, 0.45, z), (0.2, 0.75, z), (0.24, 0.99, z)])
        parts.append(tube(back, np.array([0.015, 0.019, 0.017, 0.013])))
        parts += [sphere(0.018, 16).moved(0.242, 1.0, z)]
        parts.append(tube(np.array([(-0.187, 0.16, z), (0.2, 0.16, z)]), 0.011))
    parts += [tube(np.array([(x, 0.25, -0.18), (x, 0.25, 0.18)]), 0.011) for x in (-0.184, 0.194)]
    for y, x in ((0.6, 0.19), (0.74, 0.199), (0.88, 0.221)):
        parts.append(rounded_box((x - 0.007, y, -0.18), (x + 0.007, y + 0.07, 0.18), 0.006, 2))
    return parts


def sideboard() -> list[Mesh]:
    """A low cupboard with two doors against the left wall, z in [-1.1, 0.3]."""
    x0, x1, z0, z1 = LEFT + 0.03, LEFT + 0.45, -1.1, 0.3
    parts = [
        box((x0, 0.1, z0), (x1, 0.8, z1)),
        box((x0, 0.8, z0 - 0.02), (x1 + 0.02, 0.83, z1 + 0.02)),
    ]
    parts += [
        box((x, 0, z), (x + 0.04, 0.1, z + 0.04)) for x in (x0, x1 - 0.04) for z in (z0, z1 - 0.04)
    ]
    middle = (z0 + z1) / 2
    for low, high in ((z0 + 0.03, middle - 0.004), (middle + 0.004, z1 - 0.03)):
        parts.append(box((x1, 0.14, low), (x1 + 0.018, 0.77, high)))
        parts.append(box((x1 + 0.018, 0.21, low + 0.07), (x1 + 0.024, 0.7, high - 0.07)))
    return [grained(part, "z" if i == 1 else "y", 0.9) for i, part in enumerate(parts)]


def window_frame() -> list[Mesh]:
    """Frame and glazing bars before the night sky, and the sill."""
    x0, x1, y0, y1 = WINDOW
    outline = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    frame = sweep(
        outline, [(-0.05, 0.0), (-0.05, 0.03), (0.0, 0.03), (0.0, 0.045), (0.08, 0.03), (0.08, 0)]
    )
    centre, z = (x0 + x1) / 2, FRONT
    turned_about = Mesh(
        frame.vertices * np.array([1, 1, -1]) + np.array([0, 0, z]), frame.faces[:, ::-1]
    )
    parts = [
        turned_about,
        box((centre - 0.018, y0 + 0.05, z - 0.03), (centre + 0.018, y1 - 0.05, z - 0.002)),
    ]
    for y in (y0 + (y1 - y0) / 3, y0 + (y1 - y0) * 2 / 3):
        for a, b in ((x0 + 0.05, centre - 0.018), (centre + 0.018, x1 - 0.05)):
            parts.append(box((a, y - 0.012, z - 0.026), (b, y + 0.012, z - 0.004)))
    return [*parts, box((x0 - 0.12, y0 - 0.12, z - 0.14), (x1 + 0.12, y0 - 0.085, z))]
