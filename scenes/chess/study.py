"""The study around the board: table, board, chess clock, bookcase, lamp and window frame.

Lengths are metres; the room spans x in [-2.2, 2], y in [0, 2.6], z in [-2, 2.2].
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from modelling.furniture import Parts, rod
from modelling.meshes import Mesh, box, lathe, rounded_box, sweep
from modelling.textures import fractal_noise, hash_noise, pixel_grid, planed_wood
from position import BOARD_TOP, SQUARE

ROOM_LOW, ROOM_HIGH = (-2.2, 0.0, -2.0), (2.0, 2.6, 2.2)
TABLE_TOP = 0.75
HALF = 4 * SQUARE
WINDOW = (-0.95, 0.65, 0.9, 2.2)  # z from and to, y from and to
LAMP = (0.8, 1.34, -0.35)
BOOK_COLOURS = 6
MAPLE, WALNUT_BROWN = np.array([214.0, 176, 126]), np.array([98.0, 58, 34])  # sRGB


def board_rim() -> list[Mesh]:
    """The frame around the squares and the plinth below them."""
    outline = np.array([(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)])
    rise = BOARD_TOP - TABLE_TOP
    profile = [(0.0, rise - 0.004), (0.0005, rise + 0.0005), (0.003, rise + 0.002)]
    profile += [(0.03, rise + 0.002), (0.036, rise - 0.001), (0.038, rise - 0.008)]
    profile += [(0.044, 0.008), (0.044, 0.002), (0.04, 0.001)]
    frame = sweep(outline, profile).rotated("x", -90).moved(0, TABLE_TOP)
    base = box((-HALF, TABLE_TOP + 0.001, -HALF), (HALF, BOARD_TOP - 0.003, HALF))
    return [frame, base]


def squares() -> Mesh:
    corners = [(-HALF, HALF), (HALF, HALF), (HALF, -HALF), (-HALF, -HALF)]
    vertices = np.array([(x, BOARD_TOP, z) for x, z in corners])
    texture = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], dtype=float)
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)]), texture=texture)


def board_image(pixels: int) -> np.ndarray:
    """Squares of maple and walnut with thin joints; a1, at the lower left, is dark."""
    x, y = pixel_grid((8.0, 8.0), (pixels, pixels))
    file, rank = np.floor(x), np.floor(y)
    tone = hash_noise(file, rank)
    fibre = fractal_noise(x * 9 + 31 * tone, y * 1.3 + 57 * tone)
    pores = fractal_noise(x * 40 + 5 * tone, y * 4 + 9 * tone) - 0.5
    dark = (file + rank) % 2 == 1
    wood = np.where(dark[..., None], WALNUT_BROWN, MAPLE)
    brightness = 0.86 + 0.12 * tone + 0.22 * (fibre - 0.5) + 0.22 * pores
    joint = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1)) < 0.009
    return wood * brightness[..., None] * np.where(joint, 0.5, 1.0)[..., None]


def walnut_image(pixels: int) -> np.ndarray:
    return planed_wood((1.0, 1.0), (pixels, pixels), np.array([124.0, 80, 50]), 0.24)


def table() -> list[Mesh]:
    top = rounded_box((-0.7, TABLE_TOP - 0.035, -0.52), (0.7, TABLE_TOP, 0.56), 0.012, 3)
    apron = box((-0.62, TABLE_TOP - 0.12, -0.45), (0.62, TABLE_TOP - 0.0355, 0.49))
    legs = [
        rod((x, TABLE_TOP - 0.121, z), (x, 0.003, z), 0.035, 0.022, segments=12)
        for x in (-0.56, 0.56)
        for z in (-0.4, 0.44)
    ]
    return [top, apron, *legs]


def clock() -> Parts:
    """A chess clock that faces +x, left of the board."""
    case = [rounded_box((-0.095, 0.003, -0.028), (0.095, 0.105, 0.028), 0.008, 3)]
    dials, hands, brass = [], [], []
    for x, angle in ((-0.045, 20), (0.045, -75)):
        disc = lathe([(0, 0), (0.034, 0), (0.034, 0.001), (0, 0.001)], 32).rotated("x", 90)
        dials.append(disc.moved(x, 0.054, 0.0285))
        ring = [(0.034, 0), (0.039, 0), (0.039, 0.003), (0.037, 0.005), (0.034, 0.004)]
        brass.append(lathe(ring, 32).rotated("x", 90).moved(x, 0.054, 0.0282))
        for turn, length in ((angle, 0.026), (angle + 130, 0.019)):
            hand = box((-0.0012, -0.003, 0), (0.0012, length, 0.0008)).rotated("z", turn)
            hands.append(hand.moved(x, 0.054, 0.0302))
        button = [(0, 0), (0.007, 0), (0.007, 0.01 + 0.004 * (x > 0)), (0, 0.012)]
        brass.append(lathe(button, 16).moved(x, 0.1052, 0))
    parts = {"walnut": case, "paper": dials, "black_paint": hands, "brass": brass}
    place = (-0.335, TABLE_TOP, -0.06)
    return {k: [m.rotated("y", 82).moved(*place) for m in v] for k, v in parts.items()}


def score_sheet() -> Parts:
    """A sheet of paper and a pencil, right of the board."""
    sheet = box((-0.075, 0.001, -0.105), (0.075, 0.0016, 0.105)).rotated("y", -12)
    pencil = rod((-0.06, 0.0055, 0.02), (0.07, 0.0055, -0.04), 0.0036, segments=6)
    tip = rod((0.07, 0.0055, -0.04), (0.083, 0.0055, -0.046), 0.0036, 0.0004, segments=6)
    place = (0.38, TABLE_TOP, -0.27)
    return {
        "paper": [sheet.moved(*place), tip.moved(*place)],
        "book_1": [pencil.moved(*place)],
    }


def bookcase() -> Parts:
    """Shelves along the rear wall, filled with books; some lean, some lie."""
    back, front = ROOM_LOW[2] + 0.004, ROOM_LOW[2] + 0.3
    left, right = -1.9, 1.7
    parts: Parts = {"walnut": [box((left, 0.0, back), (right, 2.2, back + 0.02))]}
    heights = (0.06, 0.4, 0.74, 1.08, 1.42, 1.78, 2.16)
    for y in heights:
        parts["walnut"].append(box((left, y, back + 0.021), (right, y + 0.024, front)))
    uprights = (left, -0.7, 0.5, right - 0.03)
    parts["walnut"] += [
        box((x, 0.0, back + 0.021), (x + 0.03, 2.2, front + 0.004)) for x in uprights
    ]
    for level, y in enumerate(heights[:-1]):
        for bay, (a, b) in enumerate(pairwise(uprights)):
            shelf(parts, a + 0.034, b - 0.004, y + 0.0245, front - 0.03, 10 * level + bay)
    return parts


def shelf(parts: Parts, left: float, right: float, bottom: float, front: float, seed: int) -> None:
    """Fills one bay with upright books up to a gap."""
    x, number = left, 0
    end = right - 0.35 * float(hash_noise(np.array([seed]), np.array([99]))[0])
    while True:
        chance = hash_noise(np.arange(4) + 50 * number, np.full(4, seed))
        thick, high, deep = (
            0.018 + 0.035 * chance[0],
            0.2 + 0.09 * chance[1],
            0.17 + 0.05 * chance[2],
        )
        if x + thick > end:
            return
        book = box((x, bottom, front - deep), (x + thick - 0.0015, bottom + high, front))
        parts.setdefault(f"book_{int(chance[3] * BOOK_COLOURS)}", []).append(book)
        x, number = x + thick, number + 1


def floor_lamp() -> Parts:
    """A brass stand; its glass globe is an emitting sphere."""
    x, y, z = LAMP
    foot = lathe([(0, 0.003), (0.14, 0.003), (0.14, 0.015), (0.03, 0.03), (0.012, 0.05), (0, 0.05)])
    cup = lathe([(0, -0.105), (0.02, -0.103), (0.035, -0.087), (0.036, -0.086), (0, -0.086)])
    stem = rod((x, 0.04, z), (x, y - 0.1, z), 0.009)
    return {"brass": [foot.moved(x, 0, z), cup.moved(x, y, z), stem]}


def window_frame() -> list[Mesh]:
    """Casing and bars before the glowing pane in the left wall, and a sill."""
    near, far, low, high = WINDOW
    x = ROOM_LOW[0]
    bars = [
        box((x, low - 0.08, near - 0.08), (x + 0.05, high + 0.08, near)),
        box((x, low - 0.08, far), (x + 0.05, high + 0.08, far + 0.08)),
        box((x, low - 0.08, near), (x + 0.05, low, far)),
        box((x, high, near), (x + 0.05, high + 0.08, far)),
        box((x, low - 0.11, near - 0.12), (x + 0.12, low - 0.081, far + 0.12)),
    ]
    middle_z, middle_y = (near + far) / 2, low + 0.62 * (high - low)
    bars.append(box((x + 0.012, low, middle_z - 0.03), (x + 0.045, high, middle_z + 0.03)))
    for a, b in ((near, middle_z - 0.031), (middle_z + 0.031, far)):
        bars.append(box((x + 0.012, middle_y - 0.02, a), (x + 0.045, middle_y + 0.02, b)))
    return bars


def panelling() -> list[Mesh]:
    """Skirting boards, and a rail along the side walls."""
    (x0, _, z0), (x1, _, z1) = ROOM_LOW, ROOM_HIGH
    return [
        box((x0, 0, z0), (x0 + 0.02, 0.14, z1)),
        box((x1 - 0.02, 0, z0), (x1, 0.14, z1)),
        box((x0 + 0.021, 0, z1 - 0.02), (x1 - 0.021, 0.14, z1)),
    ]
