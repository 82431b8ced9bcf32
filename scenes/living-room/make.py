"""Makes the assets of the living room beside itself: `python scenes/living-room/make.py`.

Every mesh is named after what it is or what it is made of, as the shapes of scene.xml are. Lengths
are metres; the room spans x in [-2.9, 2.7], y in [0, 2.6], z in [-2.5, 2.5], its window is in the
wall x = -2.9. Behind the window the balcony reaches to x = -4.4.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

from living_textures import PICTURES, book_spines, pictures, rug, table_wood
from living_things import (
    book_pile,
    bottle,
    bowl,
    coffee_table,
    faceted,
    floor_lamp,
    fruit,
    plant,
    row_of_books,
    shelf,
    smooth,
    television,
    tumbler,
    vase,
)
from living_window import balcony, balcony_plants, blind, curtain, window_frame, window_wall
from modelling.furniture import (
    Parts,
    cushion,
    merged,
    placed,
    rod,
    sideboard,
    sofa,
    spindle_armchair,
)
from modelling.meshes import Mesh, box, rectangle, sweep, write_ply
from modelling.textures import floor_boards, save_jpeg

TABLE = (-1.0, -0.42)  # x and z of its middle
TABLE_HEIGHT, TABLE_SIZE = 0.42, (1.2, 0.64)
BOTTLE = (-1.25, -0.38)
SHELF_X, SHELF_BOARDS = 1.15, [0.06, 0.4, 0.75, 1.1, 1.45, 1.8]
LAMP = (-2.38, -1.98)
FRAME = [(0.0, 0.0), (0.0, 0.012), (0.004, 0.018), (0.02, 0.018), (0.022, 0.016), (0.022, -0.012)]
"""Profile of the picture frames: distances from the inner edge and from the canvas."""


def plain(mesh: Mesh) -> Mesh:
    """With normals and without texture coordinates."""
    return faceted(Mesh(mesh.vertices, mesh.faces)) if mesh.normals is None else smooth(mesh)


def framed_picture(number: int, width: float, height: float) -> tuple[Mesh, Mesh]:
    """Canvas and frame about the origin, facing +z."""
    canvas = rectangle((-width / 2, -height / 2, 0), (width, 0, 0), (0, height, 0))
    texture = (canvas.texture + np.array([number, 0])) / np.array([PICTURES, 1])
    crop = min(width / height, 1.0), min(height / width, 1.0)
    centre = np.array([(number + 0.5) / PICTURES, 0.5])
    texture = centre + (texture - centre) * np.array(crop)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    outline = np.array(corners, float) * np.array([width, height]) / 2
    return Mesh(canvas.vertices, canvas.faces, texture=texture), sweep(outline, FRAME)


def hang(meshes: tuple[Mesh, ...], turn: float, x: float, y: float, z: float) -> list[Mesh]:
    return [mesh.rotated("y", turn).moved(x, y, z) for mesh in meshes]


def all_pictures() -> tuple[list[Mesh], list[Mesh]]:
    hung = [
        hang(framed_picture(0, 0.95, 0.56), 0, -0.8, 1.84, -2.485),
        hang(framed_picture(2, 0.5, 0.66), 90, -2.885, 1.62, 1.9),
        hang(framed_picture(1, 0.56, 0.72), 180, -0.55, 1.58, 2.485),
        hang(framed_picture(3, 0.56, 0.72), 180, -1.35, 1.58, 2.485),
    ]
    return [canvas for canvas, _ in hung], [frame for _, frame in hung]


def on_table(mesh: Mesh, x: float, z: float) -> Mesh:
    return mesh.moved(TABLE[0] + x, TABLE_HEIGHT, TABLE[1] + z)


def furniture() -> Parts:
    """Everything of which many pieces share a material."""
    armchair = spindle_armchair()
    scatter = cushion(0.44)
    seat = {
        "mustard": [scatter.rotated("x", -22).rotated("y", 12).moved(-0.58, 0.64, 0.02)],
        "teal": [scatter.rotated("x", -20).rotated("y", -16).moved(0.62, 0.64, 0.03)],
    }
    lamp = {"metal": [part.moved(LAMP[0], 0, LAMP[1]) for part in floor_lamp(1.4)]}
    rods = {"metal": [rod((-2.815, 2.32, z0), (-2.815, 2.32, z1), 0.011, 0.011)
                      for z0, z1 in ((-1.9, 1.5),)]}  # fmt: skip
    ceramics = {
        "ceramic": [
            on_table(bowl(), 0.3, 0.02),
            vase(0.26, 0.062).moved(SHELF_X + 0.3, SHELF_BOARDS[3] + 0.026, -2.33),
            vase(0.17, 0.07).moved(SHELF_X - 0.33, SHELF_BOARDS[5] + 0.026, -2.33),
        ]
    }
    fruits = [(-0.045, 0.052, 0.02, 0.039), (0.04, 0.052, 0.035, 0.038), (0.01, 0.053, -0.05, 0.04),
              (0.005, 0.11, 0.005, 0.037)]  # fmt: skip
    return merged(
        placed(sofa(2.1, 3), -2.4, 0, -0.2, 90),
        placed(seat, -2.4, 0, -0.2, 90),
        placed(armchair, 0.72, 0.012, -1.15, -62),
        placed(sideboard(1.8, 0.5, 4), -0.8, 0, -2.27),
        placed(plant(1.45, 8, 3), 2.2, 0, -2.0),
        placed(plant(1.2, 7, 9, 0.24), -2.35, 0, 1.95),
        {"foliage": balcony_plants()},
        lamp,
        rods,
        ceramics,
        {"orange": [on_table(fruit(*at), 0.3, 0.02) for at in fruits]},
    )


def books() -> list[Mesh]:
    left, right, front = SHELF_X - 0.56, SHELF_X + 0.56, -2.21
    gaps = [(0.0, 0.2), (0.25, 0.0), (0.0, 0.0), (0.0, 0.5), (0.12, 0.3)]
    rows = [
        book
        for i, (before, after) in enumerate(gaps)
        for book in row_of_books(
            left + before, right - after, SHELF_BOARDS[i] + 0.026, front, 10 * i + 4
        )
    ]
    pile = book_pile([(0.26, 0.03, 0.19), (0.23, 0.024, 0.17)], [4, 9])
    return rows + [on_table(book.rotated("y", 25), -0.05, -0.2) for book in pile]


def trim() -> list[Mesh]:
    """Skirting boards and a cornice on all four walls, and the door in the wall z = 2.5."""
    parts = []
    for low, high, depth in ((0.0, 0.1, 0.015), (2.53, 2.6, 0.05)):
        parts += [
            box((-2.9, low, -2.5), (2.7, high, -2.5 + depth)),
            box((-2.9, low, 2.5 - depth), (2.7, high, 2.5)),
            box((-2.9, low, -2.5 + depth), (-2.9 + depth, high, 2.5 - depth)),
            box((2.7 - depth, low, -2.5 + depth), (2.7, high, 2.5 - depth)),
        ]
    parts += [
        box((0.5, 0.0, 2.46), (0.58, 2.12, 2.499)),
        box((1.42, 0.0, 2.46), (1.5, 2.12, 2.499)),
    ]
    parts += [
        box((0.58, 2.04, 2.46), (1.42, 2.12, 2.499)),
        box((0.58, 0.005, 2.475), (1.42, 2.04, 2.498)),
    ]
    return parts


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""

    def write(name: str, meshes: list[Mesh]) -> None:
        write_ply(folder / f"{name}.ply", meshes)

    write("window_wall", [Mesh(part.vertices, part.faces) for part in window_wall()])
    write("balcony", [Mesh(part.vertices, part.faces) for part in balcony()])
    write("white_paint", trim() + window_frame())
    write("blind", blind())
    write("curtains", [curtain(-1.85, -1.36, 6.5), curtain(0.96, 1.45, 6.5)])
    for material, meshes in furniture().items():
        write(material, [plain(mesh) for mesh in meshes])
    outside, wet, dry, top = bottle()
    for name, mesh in (
        ("bottle", outside),
        ("water", wet),
        ("air_in_bottle", dry),
        ("water_top", top),
    ):
        write(name, [mesh.moved(BOTTLE[0], TABLE_HEIGHT, BOTTLE[1])])
    write("tumbler", [tumbler().moved(BOTTLE[0] + 0.17, TABLE_HEIGHT, BOTTLE[1] + 0.13)])
    top, frame = coffee_table(*TABLE_SIZE, TABLE_HEIGHT)
    write("table_top", [top.moved(TABLE[0], 0, TABLE[1])])
    write("table_frame", [plain(mesh.moved(TABLE[0], 0, TABLE[1])) for mesh in frame])
    screen = television(1.24, 0.7, 0.07)
    write("television", [mesh.moved(-0.8, 0.5, -2.3) for mesh in screen])
    write("shelf", [mesh.moved(SHELF_X, 0, -2.499) for mesh in shelf(1.2, 2.0, 0.32, SHELF_BOARDS)])
    write("books", books())
    canvases, frames = all_pictures()
    write("pictures", canvases)
    write("picture_frames", frames)

    save_jpeg(
        folder / "table_wood.jpg", table_wood((0.64, 1.2), (1088, 2040)), shrink=2, quality=84
    )
    save_jpeg(folder / "rug.jpg", rug((1056, 968)), shrink=2, quality=80)
    save_jpeg(folder / "pictures.jpg", pictures(512), shrink=2, quality=86)
    save_jpeg(folder / "books.jpg", book_spines((768, 512)), shrink=2, quality=82)
    boards = floor_boards((5.6, 5.0), (2016, 1800)) * np.array([1.28, 1.3, 1.3])
    save_jpeg(folder / "boards.jpg", boards, shrink=2, quality=80)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the living room.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
