"""Makes the assets of the salon beside itself: `python scenes/salon/make.py`.

- <piece>_<material>.ply: the meshes of a piece of furniture, one file for each material
- room_*.ply: mouldings, skirting, cornice, window frames and the door
- parquet.jpg: 3.2 m by 2.8 m of floor, tiled; walnut.jpg: one metre of veneer; painting.jpg

Lengths are metres; the room spans x in [-3.2, 3.2], y in [0, 2.8], z in [-2.8, 2.8].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

from modelling import furniture, ornaments
from modelling.furniture import Parts, merged, placed, rod, write_parts
from modelling.meshes import Mesh, box, lathe, rectangle, rounded_box, sweep, write_ply
from modelling.textures import save_jpeg
from parquet import chevron, painting, walnut

HALF_X, HALF_Z, HEIGHT = 3.2, 2.8, 2.8
TEXTURED = ("wood",)
WINDOWS = (-1.25, 1.1)
"""z of the windows' centres, on the wall x = -3.2; each is 1.1 wide, from y = 0.3 to 2.35."""

SKIRTING = [(-0.022, 0.0), (-0.022, 0.12), (-0.016, 0.14), (-0.006, 0.15), (0.0, 0.15)]
CORNICE = [
    (0.0, -0.15),
    (-0.02, -0.15),
    (-0.025, -0.11),
    (-0.06, -0.06),
    (-0.1, -0.04),
    (-0.11, 0.0),
]
"""Profiles: distance from the wall, outward, and from the floor or the ceiling, upward."""


def on_wall(mesh: Mesh, wall: str) -> Mesh:
    """From a wall in the plane z = 0 that faces +z to one of the room's four."""
    turn, x, z = {
        "back": (0, 0, -HALF_Z),
        "front": (180, 0, HALF_Z),
        "left": (90, -HALF_X, 0),
        "right": (-90, HALF_X, 0),
    }[wall]
    return mesh.rotated("y", turn).moved(x, 0, z)


def around(profile: list[tuple[float, float]], y: float) -> Mesh:
    """A moulding along all four walls."""
    strip = sweep(ornaments.outline(-HALF_X, -HALF_Z, HALF_X, HALF_Z), profile)
    return strip.rotated("x", -90).moved(0, y, 0)


def panelling() -> list[Mesh]:
    """Mouldings of the wall panels: a low row, a tall row above it."""
    columns = {
        "back": [(-3.05, -2.1), (-2.0, -1.05), (-0.95, 0.95), (1.05, 2.0), (2.1, 3.05)],
        "front": [(-3.05, -2.0), (-1.9, -0.85), (0.85, 1.9), (2.0, 3.05)],
        "left": [(-2.68, -2.25), (2.38, 2.7)],
        "right": [(-2.65, -1.35), (-1.25, 1.25), (1.35, 2.65)],
    }
    return [
        on_wall(sweep(ornaments.outline(left, bottom, right, top), ornaments.PANEL), wall)
        for wall, spans in columns.items()
        for left, right in spans
        for bottom, top in ((0.25, 0.8), (0.95, 2.5))
    ]


def window(z: float) -> list[Mesh]:
    """Casing and glazing bars before the bright pane at x = -3.19, and a sill."""
    frame = [
        sweep(
            ornaments.outline(z - 0.55, 0.3, z + 0.55, 2.35),
            [(-0.04, 0.0), (-0.04, 0.05), *_casing()],
        )
    ]
    frame += [box((z - 0.025, 0.3, 0.014), (z + 0.025, 2.35, 0.045))]
    frame += [
        box((z - 0.55, y - 0.012, 0.016), (z + 0.55, y + 0.012, 0.035)) for y in (0.75, 1.28, 1.81)
    ]
    frame += [
        box((z + s * 0.265 - 0.01, 0.3, 0.018), (z + s * 0.265 + 0.01, 2.35, 0.033))
        for s in (-1, 1)
    ]
    frame.append(box((z - 0.65, 0.17, 0.0), (z + 0.65, 0.21, 0.1)))
    return [on_wall(mesh, "left") for mesh in frame]


def _casing() -> list[tuple[float, float]]:
    return [(0.0, 0.03), (0.07, 0.035), (0.085, 0.02), (0.085, 0.0)]


def door() -> list[Mesh]:
    """A double door in the front wall."""
    leaves = [box((x - 0.33, 0.01, 0.0), (x + 0.33, 2.2, 0.02)) for x in (-0.335, 0.335)]
    frames = [
        sweep(ornaments.outline(x - 0.24, low, x + 0.24, high), ornaments.PANEL).moved(0, 0, 0.02)
        for x in (-0.335, 0.335)
        for low, high in ((0.15, 0.85), (0.98, 2.08))
    ]
    casing = [box((s * 0.73 - 0.06, 0.0, 0.0), (s * 0.73 + 0.06, 2.33, 0.03)) for s in (-1, 1)]
    casing.append(box((-0.669, 2.21, 0.0), (0.669, 2.33, 0.03)))
    return [on_wall(mesh, "front") for mesh in leaves + frames + casing]


def television() -> Parts:
    """1.55 by 0.88, leant back by six degrees, on a foot; its back lies near z = -0.1."""
    housing = [rounded_box((-0.775, 0.0, -0.045), (0.775, 0.88, 0.0), 0.008, 2)]
    housing.append(box((-0.16, -0.06, -0.06), (0.16, 0.25, -0.046)))
    screen = rectangle((-0.763, 0.02, 0.0015), (1.526, 0, 0), (0, 0.848, 0))
    foot = [rounded_box((-0.3, 0.0, -0.14), (0.3, 0.014, 0.1), 0.006, 2),
            box((-0.12, 0.01, -0.07), (0.12, 0.2, -0.058))]  # fmt: skip
    return {
        "black": [m.rotated("x", -6).moved(0, 0.09, 0) for m in housing] + foot,
        "screen": [screen.rotated("x", -6).moved(0, 0.09, 0)],
    }


def slatted_screen() -> Parts:
    """Three folding leaves of upright slats, along x, 1.5 wide and 1.7 high."""
    leaves = []
    for leaf, turn in enumerate((32, -32, 32)):
        wood = [box((x - 0.015, 0.01, -0.012), (x + 0.015, 1.7, 0.012)) for x in (-0.27, 0.27)]
        wood += [box((-0.254, y - 0.02, -0.01), (0.254, y + 0.02, 0.01)) for y in (0.12, 1.2, 1.66)]
        wood += [
            box((x - 0.008, 0.141, -0.006), (x + 0.008, y, 0.006))
            for x in np.linspace(-0.225, 0.225, 10)
            for y in (1.179,)
        ]
        wood += [
            box((x - 0.008, 1.221, -0.006), (x + 0.008, 1.639, 0.006))
            for x in np.linspace(-0.225, 0.225, 10)
        ]
        leaves.append(placed({"wood": wood}, 0.49 * (leaf - 1), 0, 0, turn))
    return merged(*leaves)


def seating() -> Parts:
    """The set that moves on the floor: two chairs and a round table with tea on it."""
    tea = merged(
        placed(ornaments.teapot(), 0.03, 0.4405, -0.04, 30),
        placed({"ceramic": [ornaments.cup()]}, 0.2, 0.4405, 0.15),
        placed({"ceramic": [ornaments.cup()]}, -0.19, 0.4405, 0.12),
        placed(ornaments.books([0.24, 0.2], [0.03, 0.022], [12, -9]), -0.2, 0.4405, -0.16, 20),
    )
    return merged(
        furniture.round_table(0.42, 0.44),
        tea,
        placed(furniture.spindle_armchair(), -0.98, 0, -0.1, 68),
        placed(furniture.spindle_armchair(), 0.95, 0, -0.22, -62),
    )


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    write_parts(folder, "seating", seating(), TEXTURED)
    right_wall = merged(
        placed(furniture.sofa(2.1, 3), 2.68, 0, 0.1, -90),
        placed({"cushion": [furniture.cushion(0.42).rotated("x", -24)]}, 2.63, 0.64, -0.62, -75),
        placed({"cushion": [furniture.cushion(0.38).rotated("x", -24)]}, 2.61, 0.62, 0.88, -108),
    )
    back_wall = merged(
        placed(furniture.sideboard(2.3, 0.62, 4), 0, 0, -2.53),
        placed(television(), 0, 0.622, -2.47),
        placed({"ceramic": [ornaments.vase("bottle")]}, -0.98, 0.622, -2.5),
        placed({"ceramic": [ornaments.vase("drum")]}, 0.99, 0.622, -2.52),
        placed(slatted_screen(), 2.36, 0, -2.22, -22),
        placed(ornaments.fig_tree(1.75, seed=4), -2.55, 0, -2.2),
    )
    write_parts(folder, "fixed", merged(right_wall, back_wall), TEXTURED)
    sheets = [
        ornaments.curtain(0.42, 2.6, 5).moved(side * 0.84 - z) for z in WINDOWS for side in (-1, 1)
    ]
    curtains = [on_wall(sheet.moved(0, 0, 0.12), "left") for sheet in sheets]
    rails = [
        rod((-HALF_X + 0.12, 2.62, z - 1.1), (-HALF_X + 0.12, 2.62, z + 1.1), 0.012)
        for z in WINDOWS
    ]
    trim = [around(SKIRTING, 0.0), around(CORNICE, HEIGHT), *door()]
    trim += [mesh for z in WINDOWS for mesh in window(-z)]
    room = {
        "wall_paint": panelling(),
        "white_paint": trim,
        "curtain_fabric": curtains,
        "brass": rails,
    }
    canvas = ornaments.outline(-0.75, 1.2, 0.75, 2.2)
    room["gilding"] = [on_wall(sweep(canvas, ornaments.FRAME).moved(0.1), "right")]
    write_parts(folder, "room", room, TEXTURED)
    picture = rectangle((-0.65, 1.2, 0.01), (1.5, 0, 0), (0, 1, 0))
    write_ply(folder / "picture.ply", [on_wall(picture, "right")])
    pole = [rod((0, 2.47, 0), (0, 2.79, 0), 0.01)]
    canopy = lathe([(0, 2.775), (0.03, 2.775), (0.07, 2.79), (0.07, 2.798), (0, 2.798)], 32)
    cap = lathe([(0, 2.453), (0.06, 2.453), (0.06, 2.465), (0.012, 2.485), (0, 2.485)], 24)
    write_parts(folder, "pendant", {"brass": [*pole, canopy, cap]}, TEXTURED)

    save_jpeg(folder / "parquet.jpg", chevron((3.2, 2.8), (2048, 1792)), shrink=2, quality=78)
    save_jpeg(folder / "walnut.jpg", walnut(1024), shrink=2, quality=80)
    save_jpeg(folder / "painting.jpg", painting((960, 640)), shrink=2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the salon.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
