"""Makes the assets of the bedroom beside itself: `python scenes/bedroom/make.py`.

Files named after a material (walnut.ply, brass.ply, …) hold everything that is made of it. The
others: wallpaper, carpet, prints and floor with their images, panorama.jpg for the sky.

Lengths are metres; the room spans x in [-2.4, 2.4], y in [0, 2.65], z in [-2.3, 2.4]. The window
is in the wall x = -2.4, the bed's head at z = -2.3, the wardrobe along x = 2.4.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

from bedding import bed
from bedroom_furniture import (
    bedside_table,
    bedside_things,
    curtain,
    framed_picture,
    globe_lamp,
    pouf,
    radiator,
    rubber_plant,
    wardrobe,
)
from bedroom_textures import abstract_print, carpet, knit, panorama, wallpaper
from modelling.furniture import Parts, finished, merged, placed, rod
from modelling.meshes import Mesh, box, lathe, sphere, write_ply
from modelling.textures import WALNUT, floor_boards, planed_wood, save_jpeg

LEFT, RIGHT, HEIGHT, BACK, FRONT = -2.4, 2.4, 2.65, -2.3, 2.4
OAK = np.array([206.0, 172, 130])  # sRGB
LAMP_HOUSING = [(0, 2.585), (0.385, 2.585), (0.39, 2.57), (0.4, 2.57), (0.4, 2.65)]
"""Radius and height of the ceiling lamp's rim; the emitting disk hangs in it at 2.58."""
WALL = 0.26
WINDOW_LOW, WINDOW_HIGH, WINDOW_BACK, WINDOW_FRONT = 0.64, 2.36, -1.0, 1.3
BED_X, BED_Z = -0.1, -2.16
TABLES_X = (-1.25, 1.05)
TABLE_Z = -2.06


def walls() -> Parts:
    """Window wall with its opening, front wall with a door, right wall; ceiling; trim."""
    outer, wide = LEFT - WALL, 0.3
    plaster = [
        box((outer, -0.1, BACK - wide), (LEFT, WINDOW_LOW, FRONT + wide)),
        box((outer, WINDOW_HIGH, BACK - wide), (LEFT, HEIGHT + 0.1, FRONT + wide)),
        box((outer, WINDOW_LOW, BACK - wide), (LEFT, WINDOW_HIGH, WINDOW_BACK)),
        box((outer, WINDOW_LOW, WINDOW_FRONT), (LEFT, WINDOW_HIGH, FRONT + wide)),
        box((LEFT, -0.1, FRONT), (RIGHT + 0.2, HEIGHT + 0.1, FRONT + 0.2)),
        box((RIGHT, -0.1, BACK), (RIGHT + 0.2, HEIGHT + 0.1, FRONT)),
        box((LEFT, -0.1, BACK - 0.2), (RIGHT + 0.2, HEIGHT + 0.1, BACK - 0.003)),
    ]
    ceiling = box((LEFT - 0.1, HEIGHT, BACK - 0.1), (RIGHT + 0.1, HEIGHT + 0.2, FRONT + 0.1))
    trim = [
        ceiling,
        box(
            (outer - 0.05, WINDOW_LOW, WINDOW_BACK), (LEFT + 0.06, WINDOW_LOW + 0.03, WINDOW_FRONT)
        ),
    ]
    for low, high, depth in ((0, 0.11, 0.016), (HEIGHT - 0.07, HEIGHT, 0.05)):
        trim += [
            box((LEFT, low, BACK), (RIGHT, high, BACK + depth)),
            box((LEFT, low, BACK + depth), (LEFT + depth, high, FRONT)),
            box((RIGHT - depth, low, BACK + depth), (RIGHT, high, FRONT)),
            box((LEFT + depth, low, FRONT - depth), (RIGHT - depth, high, FRONT)),
        ]
    return {"plaster": plaster, "white_paint": trim + window_frame() + room_door()}


def window_frame() -> list[Mesh]:
    """Two casements with glazing bars; the opening stays free, as if it had no panes."""
    x0, x1 = LEFT - 0.16, LEFT - 0.1
    low, high = WINDOW_LOW + 0.03, WINDOW_HIGH
    middle = (WINDOW_BACK + WINDOW_FRONT) / 2
    bars = [
        box((x0, low, WINDOW_BACK), (x1, low + 0.06, WINDOW_FRONT)),
        box((x0, high - 0.06, WINDOW_BACK), (x1, high, WINDOW_FRONT)),
        box((x0 - 0.01, low + 0.06, middle - 0.045), (x1 + 0.01, high - 0.06, middle + 0.045)),
    ]
    for z in (WINDOW_BACK, WINDOW_FRONT - 0.06):
        bars.append(box((x0, low + 0.06, z), (x1, high - 0.06, z + 0.06)))
    for start, end in ((WINDOW_BACK + 0.06, middle - 0.045), (middle + 0.045, WINDOW_FRONT - 0.06)):
        cross = low + 0.68 * (high - low)
        bars.append(box((x0 + 0.012, cross - 0.014, start), (x1 - 0.012, cross + 0.014, end)))
    return bars


def room_door() -> list[Mesh]:
    """A panelled door in the front wall, with its architrave."""
    z = FRONT
    parts = [box((-0.5, 0, z - 0.03), (-0.42, 2.12, z)), box((0.42, 0, z - 0.03), (0.5, 2.12, z))]
    parts.append(box((-0.5, 2.12, z - 0.03), (0.5, 2.2, z)))
    parts.append(box((-0.42, 0.01, z - 0.012), (0.42, 2.12, z - 0.001)))
    for low, high in ((0.15, 0.95), (1.1, 2.0)):
        parts += [box((x, low, z - 0.022), (x + 0.32, high, z - 0.012)) for x in (-0.36, 0.04)]
    return parts


def furnishing() -> Parts:
    head, right = {"brass": [rod((LEFT + 0.1, 2.48, -1.65), (LEFT + 0.1, 2.48, 1.95), 0.012)]}, 90
    head["brass"] += [sphere(0.028, 16).moved(LEFT + 0.1, 2.48, z) for z in (-1.67, 1.97)]
    head["brass"].append(sphere(0.03, 16).moved(-0.34, 1.02, FRONT - 0.06))
    drapes = [curtain(0.52, 2.46, 0.2), curtain(0.52, 2.46, 0.55)]
    hung = [
        drape.rotated("y", -90).moved(LEFT + 0.1, 0, z)
        for drape, z in zip(drapes, (-1.56, 1.36), strict=True)
    ]
    tables = [
        merged(bedside_table(), placed(globe_lamp(), lamp_x, 0.501, -0.06))
        for lamp_x in (0.06, -0.06)
    ]
    return merged(
        placed(bed(), BED_X, 0, BED_Z),
        placed(wardrobe(), RIGHT - 0.005, 0, 0.1, -right),
        placed(tables[0], TABLES_X[0], 0, TABLE_Z),
        placed(tables[1], TABLES_X[1], 0, TABLE_Z),
        placed(bedside_things(), TABLES_X[1] + 0.1, 0.501, TABLE_Z + 0.06),
        placed({"white_paint": radiator(1.5)}, LEFT, 0, 0.15, 90),
        placed(rubber_plant(1.45), -1.98, 0, -1.75),
        placed({"clay_knit": [pouf()]}, -1.35, 0.012, 0.35),
        {"curtain": hung, "white_paint": [lathe(LAMP_HOUSING, 48).moved(0.1, 0, 0.2)]},
        head,
    )


def pictures() -> tuple[list[Mesh], list[Mesh]]:
    """Two prints side by side above the bed, and their frames."""
    prints, frames = [], []
    for index, x in enumerate((BED_X - 0.4, BED_X + 0.4)):
        image, frame = framed_picture(0.56, 0.74)
        texture = image.texture * np.array([0.5, 1.0]) + np.array([0.5 * index, 0.0])
        prints.append(Mesh(image.vertices, image.faces, texture=texture).moved(x, 1.72, BACK))
        frames.append(frame.moved(x, 1.72, BACK))
    return prints, frames


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    prints, frames = pictures()
    room = merged(walls(), furnishing(), {"walnut": frames})
    for material, meshes in room.items():
        if material != "throw":  # whose texture coordinates follow the cloth
            meshes = [finished(mesh, textured=material == "walnut") for mesh in meshes]
        write_ply(folder / f"{material}.ply", meshes)
    write_ply(folder / "prints.ply", prints)

    images = np.concatenate([abstract_print(i, (512, 676)) for i in range(2)], axis=1)
    save_jpeg(folder / "prints.jpg", images, shrink=2)
    save_jpeg(folder / "carpet.jpg", carpet((2.6, 3.2), (1664, 2048)), shrink=2, quality=80)
    save_jpeg(folder / "wallpaper.jpg", wallpaper((0.96, 0.8), (1536, 1280)), shrink=2, quality=80)
    save_jpeg(folder / "throw.jpg", knit(512), shrink=2)
    wood = planed_wood((1.0, 1.0), (1024, 1024))
    save_jpeg(folder / "walnut.jpg", np.rot90(wood), shrink=2, quality=80)
    boards = OAK / WALNUT * floor_boards((RIGHT - LEFT, FRONT - BACK), (1536, 1504))
    save_jpeg(folder / "boards.jpg", boards, shrink=2, quality=82)
    save_jpeg(folder / "panorama.jpg", panorama((768, 384)), shrink=2, quality=88)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the bedroom.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
