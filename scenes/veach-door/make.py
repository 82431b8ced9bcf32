"""Makes the assets of Veach Door beside itself: `python scenes/veach-door/make.py`.

- glass_pot.ply, steel_pot.ply, clay_pot.ply: the teapots (teapot.py), where they stand
- door.ply, door_handles.ply: about the hinge, closed
- walls, dado, trim, hall, furniture (door_room.py), pictures and their frames
- tiles.jpg, wood.jpg, pictures.jpg: textures (door_pictures.py)
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

import door_room as room
from door_pictures import checkered_tiles, leaf_print, seascape
from modelling.meshes import Mesh, box, grained, lathe, rectangle, sweep, write_ply
from modelling.textures import planed_wood, save_jpeg
from teapot import closed_teapot, glass_teapot

POTS = {
    "glass_pot": (0.14, -0.2, 205.0),
    "steel_pot": (0.6, -0.5, -35.0),
    "clay_pot": (1.02, -0.22, -150.0),
}
"""Position x, z on the table and degrees about y of each teapot."""

PICTURES = (
    ("back", 0.95, 1.62, 0.54, 0.405),
    ("left", -0.35, 1.62, 0.17, 0.425),
    ("hall", -1.75, 1.6, 0.2, 0.5),
)
"""Wall, centre along it, centre y, half width and half height of each picture."""

ATLAS = (0, 640, 832, 1024)
"""Columns of pictures.jpg between which the pictures lie side by side."""

MOULDING = [(0.0, 0.004), (0.0, 0.016), (0.014, 0.028), (0.034, 0.022), (0.052, 0.034), (0.06, 0.0)]
MAT_MOULDING = [(0.0, 0.004), (0.0, 0.018), (0.018, 0.018), (0.018, 0.0)]


def on_wall(mesh: Mesh, wall: str) -> Mesh:
    """From the plane z = 0 to the back or left wall, or the far wall of the bright room."""
    if wall != "left":
        return mesh.moved(z=room.BACK if wall == "back" else room.FAR)
    return mesh.rotated("y", 90).moved(x=room.LEFT)


def hang_pictures(folder: Path) -> None:
    canvases, frames = [], []
    for index, (wall, centre, y, w, h) in enumerate(PICTURES):
        x = -centre if wall == "left" else centre  # rotated by 90 degrees, x points to -z
        canvas = rectangle((x - w, y - h, 0.008), (2 * w, 0, 0), (0, 2 * h, 0))
        left, right = ATLAS[index] / ATLAS[-1], ATLAS[index + 1] / ATLAS[-1]
        texture = canvas.texture * [right - left, 1] + [left, 0]
        canvases.append(on_wall(Mesh(canvas.vertices, canvas.faces, texture=texture), wall))
        outline = np.array([(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)])
        frames.append(on_wall(sweep(outline, MOULDING if wall == "back" else MAT_MOULDING), wall))
    write_ply(folder / "pictures.ply", canvases)
    write_ply(folder / "picture_frames.ply", frames)
    heights, widths = 480, np.diff(ATLAS)
    images = [
        seascape(widths[0], heights),
        *[leaf_print(w, heights, 2.0 * i) for i, w in enumerate(widths[1:])],
    ]
    save_jpeg(folder / "pictures.jpg", np.concatenate(images, axis=1), quality=85)


def hall() -> list[Mesh]:
    """Walls and ceiling of the bright room; the dividing wall and the floor are separate."""
    x0, x1, z0, z1, y = room.HALL_LEFT, room.HALL_RIGHT, room.FAR, room.BACK - room.WALL, room.TOP
    return [
        rectangle((x0, 0, z0), (x1 - x0, 0, 0), (0, y, 0)),
        rectangle((x0, 0, z1), (0, 0, z0 - z1), (0, y, 0)),
        rectangle((x1, 0, z0), (0, 0, z1 - z0), (0, y, 0)),
        rectangle((x0, y, z0), (x1 - x0, 0, 0), (0, 0, z1 - z0)),
    ]


def hall_trim() -> list[Mesh]:
    """Skirting, dado rail and cornice along the far wall of the bright room."""
    z, x0, x1 = room.FAR, room.HALL_LEFT, room.HALL_RIGHT
    boards = ((0, 0.16, 0.024), (0.83, 0.88, 0.03), (2.5, 2.6, 0.06))
    return [box((x0, low, z), (x1, high, z + depth)) for low, high, depth in boards]


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    for name, (x, z, degrees) in POTS.items():
        parts = glass_teapot() if name == "glass_pot" else closed_teapot()
        height = room.TABLE_HEIGHT + 0.0005
        write_ply(
            folder / f"{name}.ply", [p.rotated("y", degrees).moved(x, height, z) for p in parts]
        )

    write_ply(folder / "door.ply", room.door_leaf())
    write_ply(folder / "door_handles.ply", room.door_handles())
    write_ply(folder / "dividing_wall.ply", room.dividing_wall())
    write_ply(folder / "dado.ply", [*room.strip(0, room.DADO, 0.008), *room.stiles()])
    skirting, rail = (
        room.strip(0, 0.16, 0.024),
        room.strip(room.DADO - 0.03, room.DADO + 0.02, 0.03),
    )
    trim = [
        *skirting,
        *rail,
        *room.strip(2.5, 2.6, 0.06),
        *room.door_frame(),
        *room.window_frame(),
        *hall_trim(),
    ]
    write_ply(folder / "trim.ply", trim)
    write_ply(folder / "hall.ply", hall())
    threshold = grained(box((-1.35, 0, room.BACK - room.WALL), (-0.45, 0.004, room.BACK)), "x", 0.9)
    write_ply(folder / "woodwork.ply", [*room.table(), *room.sideboard(), threshold])
    placed = [part.rotated("y", 14).moved(1.66, 0, -0.36) for part in room.chair()]
    write_ply(folder / "chair.ply", placed)
    vase = [
        (0, 0),
        (0.05, 0),
        (0.055, 0.004),
        (0.085, 0.08),
        (0.1, 0.15),
        (0.085, 0.22),
        (0.045, 0.28),
    ]
    vase += [(0.036, 0.31), (0.05, 0.345), (0.046, 0.346), (0.032, 0.31), (0.04, 0.27), (0, 0.2)]
    write_ply(folder / "vase.ply", [lathe(vase, 40).moved(-2.37, 0.8305, -0.78)])
    hang_pictures(folder)

    extent = (room.RIGHT - room.LEFT, room.FRONT - room.BACK)
    save_jpeg(folder / "tiles.jpg", checkered_tiles(extent, (1560, 1440)), shrink=2, quality=80)
    save_jpeg(folder / "wood.jpg", planed_wood((0.9, 0.9), (1024, 1024)), shrink=2, quality=82)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of Veach Door.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
