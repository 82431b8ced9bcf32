"""The living room with a dining area: what stands where, and how far it may move and turn.

Lengths are metres, angles degrees; x in [-4.2, 4.2], y in [0, 2.75], z in [-3.2, 3.2].
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from modelling import furniture, ornaments
from modelling.furniture import FOOT, Parts, merged, placed, rod
from modelling.meshes import Mesh, box, lathe, sweep

HALF_X, HALF_Z, HEIGHT = 4.2, 3.2, 2.75
WINDOW_HALF, WINDOW_BOTTOM, WINDOW_TOP = 2.3, 0.08, 2.4  # of the opening in the wall x = -4.2


@dataclass(frozen=True)
class Mover:
    """Pieces that move and turn together about their common centre (x, z)."""

    pieces: dict[str, Parts]
    x: float
    z: float
    turn: float = 0.0
    low: tuple[float, float] = (0.0, 0.0)
    high: tuple[float, float] = (0.0, 0.0)
    turns: tuple[float, float] = (0.0, 0.0)
    choices: bool = False  # whether just one of the pieces shows


CHAIRS = {
    "slat": furniture.slat_chair,
    "shell": furniture.shell_chair,
    "padded": furniture.padded_chair,
}

COFFEE_HEIGHT, DINING_HEIGHT, SIDEBOARD_HEIGHT = 0.4, 0.75, 0.72


def dining_chair(name: str, x: float, z: float, turn: float, low: float, high: float) -> Mover:
    """One of four; its three models stand in the same place and one of them shows."""
    pieces = {f"{name}_{kind}": model() for kind, model in CHAIRS.items()}
    return Mover(pieces, x, z, turn, (-0.08, low), (0.08, high), (-25, 25), choices=True)


def coffee_table() -> dict[str, Parts]:
    table = furniture.round_table(0.46, COFFEE_HEIGHT)
    y = COFFEE_HEIGHT + 0.0005
    stack = ornaments.books([0.27, 0.23, 0.2], [0.03, 0.024, 0.02], [8, -10, 15])
    cup = {"ceramic": [ornaments.cup()]}
    tea = merged(ornaments.teapot(), placed(cup, 0.06, 0, 0.14), placed(cup, 0.16, 0, 0.05))
    return {
        "coffee_table": {"wood": table["wood"]},
        "coffee_table_top": {"marble": table["table_top"]},
        "books": placed(stack, -0.22, y, -0.1, 35),
        "teapot": placed(tea, 0.12, y, 0.02, -20),
    }


def dining_table() -> dict[str, Parts]:
    table = furniture.long_table(1.7, 0.9, DINING_HEIGHT)
    y = DINING_HEIGHT + 0.0005
    plate = [
        (0, 0),
        (0.07, 0),
        (0.08, 0.006),
        (0.125, 0.016),
        (0.122, 0.018),
        (0.075, 0.009),
        (0, 0.008),
    ]
    plates = [lathe(plate, 32).moved(x, 0, z) for x in (-0.42, 0.42) for z in (-0.29, 0.29)]
    glass = [
        (0, 0),
        (0.026, 0),
        (0.03, 0.004),
        (0.034, 0.09),
        (0.032, 0.09),
        (0.028, 0.008),
        (0, 0.007),
    ]
    plates += [
        lathe(glass, 24).moved(x + 0.19, 0, 0.62 * z) for x in (-0.42, 0.42) for z in (-0.29, 0.29)
    ]
    return {
        "dining_table": {"wood": table["wood"]},
        "dining_table_top": {"oak": table["table_top"]},
        "crockery": placed({"porcelain": plates}, 0, y, 0),
        "fruit_bowl": placed(ornaments.fruit_bowl(0.15), -0.02, y, 0.0),
    }


def living_sofa() -> Parts:
    pillows = [
        (-0.72, 0.62, -0.08, 14, 0.44),
        (0.76, 0.61, -0.07, -12, 0.4),
    ]
    scatter = [
        furniture.cushion(size).rotated("x", -22).rotated("y", turn).moved(x, y + 0.05, z + 0.14)
        for x, y, z, turn, size in pillows
    ]
    return merged(furniture.sofa(2.2, 3), {"cushion": scatter})


def on_sideboard(parts: Parts) -> Parts:
    return placed(parts, 0, SIDEBOARD_HEIGHT + 0.0005, 0)


MOVERS = {
    "sofa": Mover({"sofa": living_sofa()}, -1.75, -2.45, 0, (-0.2, -0.05), (0.2, 0.2), (-7, 7)),
    "armchair_left": Mover(
        {"armchair_left": furniture.club_chair()},
        -3.15, -0.5, 90, (-0.12, -0.3), (0.12, 0.3), (-30, 30),
    ),
    "armchair_right": Mover(
        {"armchair_right": furniture.spindle_armchair()},
        -0.1, -0.4, -90, (-0.12, -0.3), (0.2, 0.3), (-35, 35),
    ),
    "coffee_table": Mover(coffee_table(), -1.7, -0.75, 0, (-0.15, -0.2), (0.15, 0.25), (-90, 90)),
    "dining_table": Mover(dining_table(), 2.35, -0.55, 0, (-0.06, -0.04), (0.06, 0.04), (-5, 5)),
    "chair_1": dining_chair("chair_1", 1.9, -1.55, 0, -0.4, 0.05),
    "chair_2": dining_chair("chair_2", 2.8, -1.55, 0, -0.4, 0.05),
    "chair_3": dining_chair("chair_3", 1.9, 0.45, 180, -0.05, 0.35),
    "chair_4": dining_chair("chair_4", 2.8, 0.45, 180, -0.05, 0.35),
    "floor_lamp": Mover(
        {"floor_lamp": ornaments.lamp_stand(1.4)}, -3.55, -2.6, 0, (-0.2, -0.25), (0.2, 0.25)
    ),
    "plant": Mover({"plant": ornaments.fig_tree(1.7, seed=8)}, 0.3, -2.7),
    "vase": Mover(
        {f"vase_{k}": on_sideboard({"ceramic": [ornaments.vase(k)]}) for k in ornaments.VASES},
        1.8, -2.95, 0, (-0.25, -0.08), (0.25, 0.08), choices=True,
    ),
    "bowl": Mover(
        {"bowl": on_sideboard({"porcelain": [ornaments.bowl(0.16)]})},
        2.8, -2.95, 0, (-0.3, 0), (0.3, 0),
    ),
}  # fmt: skip
"""Everything that moves; a plant that only comes and goes is here for its place."""


def window_wall() -> tuple[list[Mesh], list[Mesh]]:
    """The wall x = -4.2, 0.2 thick, around the opening; and the window's frame in it."""
    out, inner = -HALF_X - 0.2, -HALF_X
    wall = [
        box((out, -0.1, -HALF_Z - 0.1), (inner, HEIGHT + 0.1, -WINDOW_HALF)),
        box((out, -0.1, WINDOW_HALF), (inner, HEIGHT + 0.1, HALF_Z + 0.1)),
        box((out, WINDOW_TOP, -WINDOW_HALF), (inner, HEIGHT + 0.1, WINDOW_HALF)),
        box((out, -0.1, -WINDOW_HALF), (inner, WINDOW_BOTTOM, WINDOW_HALF)),
    ]
    low, high = WINDOW_BOTTOM + 0.001, WINDOW_TOP - 0.001
    edges = np.linspace(-WINDOW_HALF + 0.001, WINDOW_HALF - 0.001, 5)
    frame = [
        box(
            (out + 0.08, low, max(z - 0.03, edges[0])), (out + 0.13, high, min(z + 0.03, edges[-1]))
        )
        for z in edges
    ]
    for z0, z1 in pairwise(edges):
        spans = [(low, low + 0.06), (1.9, 1.95), (high - 0.05, high)]
        frame += [box((out + 0.085, a, z0 + 0.031), (out + 0.125, b, z1 - 0.031)) for a, b in spans]
    return wall, frame


def bookshelf() -> Parts:
    """Against the wall x = 4.2, between z = -1.3 and 1.3; 0.32 deep, 2.1 high."""
    random = np.random.Generator(np.random.PCG64(3))
    wood = [box((3.87, y, -1.3), (4.18, y + 0.03, 1.3)) for y in (0.1, 0.5, 0.9, 1.3, 1.7, 2.07)]
    shelves = (0.131, 0.531, 0.931, 1.331, 1.731)
    wood += [
        box((3.88, y, z - 0.015), (4.175, min(y + 0.368, 2.069), z + 0.015))
        for y in shelves
        for z in (-1.28, -0.43, 0.43, 1.28)
    ]
    parts: Parts = {"wood": wood}
    for shelf in shelves:
        for left in (-1.26, -0.41, 0.45):
            z = left + random.uniform(0, 0.1)
            while z < left + random.uniform(0.45, 0.78):
                thick, high = random.uniform(0.022, 0.06), random.uniform(0.2, 0.3)
                deep = random.uniform(0.17, 0.22)
                book = box((4.17 - deep, shelf, z), (4.17, shelf + high, z + thick))
                parts.setdefault(f"book_{random.integers(3)}", []).append(book)
                z += thick + 0.001
    return parts


FRAMED = {
    "picture_left": (-2.3, 1.68, 0.36, 0.45),
    "picture_middle": (-1.2, 1.68, 0.36, 0.45),
    "picture_right": (2.4, 1.7, 0.6, 0.45),
}
"""Pictures on the wall z = -3.2: centre x, y, half width, half height."""


def static_parts() -> Parts:
    """All that never moves, but for the flat walls, the floor and what shines."""
    wall, frame = window_wall()
    sheets = [
        ornaments.curtain(0.75, 2.62, 8).rotated("y", 90).moved(-4.03, 0, z) for z in (-2.6, 2.6)
    ]
    frames = [
        sweep(ornaments.outline(x - w, y - h, x + w, y + h), ornaments.FRAME).moved(z=-HALF_Z)
        for x, y, w, h in FRAMED.values()
    ]
    cords = [rod((x, 1.88, -0.55), (x, HEIGHT - 0.002, -0.55), 0.004) for x in (2.05, 2.65)]
    cap = lathe([(0, 1.873), (0.05, 1.873), (0.05, 1.885), (0.01, 1.91), (0, 1.91)], 24)
    caps = [cap.moved(x, 0, -0.55) for x in (2.05, 2.65)]
    skirting = [
        box((-HALF_X, 0, -HALF_Z), (HALF_X, 0.09, -HALF_Z + 0.015)),
        box((-HALF_X, 0, HALF_Z - 0.015), (HALF_X, 0.09, HALF_Z)),
        box((HALF_X - 0.015, 0, -HALF_Z + 0.015), (HALF_X, 0.09, HALF_Z - 0.015)),
    ]
    return merged(
        {"wall_paint": wall, "white_paint": skirting, "black": frame + frames},
        {
            "curtain_fabric": sheets,
            "brass": cords + caps + [rod((-4.03, 2.64, -3.0), (-4.03, 2.64, 3.0), 0.012)],
        },
        placed(furniture.sideboard(2.3, SIDEBOARD_HEIGHT, 4), 2.4, 0, -2.95),
        bookshelf(),
    )


__all__ = ["FOOT", "FRAMED", "MOVERS", "Mover", "static_parts"]
