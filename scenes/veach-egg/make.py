"""Makes the assets of Veach Egg beside itself: `python scenes/veach-egg/make.py`.

- egg.ply, cup.ply: about the axis of the egg, on y = 0 (egg.py)
- spotlight.ply, reflector.ply: about the vertical through the bulb, on the floor (egg.py)
- wainscot, cornice, table_top, table_foot, wall_lamp, frame, picture (panelled_room.py)
- oak.jpg, mahogany.jpg, boards.jpg, picture.jpg: textures
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

import panelled_room as room
from egg import cup, egg, spotlight
from modelling.meshes import rectangle, sweep, write_ply
from modelling.textures import floor_boards, fractal_noise, pixel_grid, planed_wood, save_jpeg

BEAM = np.array([0.8, -0.83, -0.8])
"""Direction of the spotlight, as in scene.xml."""
OAK, MAHOGANY = np.array([188.0, 160, 124]), np.array([146.0, 98, 68])  # sRGB


def hills(width: int, height: int) -> np.ndarray:
    """Ranges of hills in the mist, [height, width, 3] sRGB in 0 to 255."""
    x, y = pixel_grid((width / height, 1.0), (width, height))
    image = np.array([236.0, 214, 176]) - y[..., None] * np.array([10.0, 30, 30])
    for i in range(6):
        crest = 0.34 + 0.11 * i - 0.16 * fractal_noise(x * (1.6 + 0.5 * i) + 9 * i, 0 * x + i, 5)
        near = (i + 1) / 6
        colour = np.array([176.0, 178, 164]) * (1 - near) + np.array([42.0, 58, 46]) * near
        mist = np.clip((y - crest) / 0.2, 0, 1)[..., None] * 26 * (1 - near)
        image = np.where((y > crest)[..., None], colour + mist, image)
    return image + 10 * (fractal_noise(x * 60, y * 60)[..., None] - 0.5)


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    write_ply(folder / "egg.ply", [egg()])
    write_ply(folder / "cup.ply", [cup()])
    outside, inside = spotlight(BEAM)
    write_ply(folder / "spotlight.ply", outside)
    write_ply(folder / "reflector.ply", inside)

    write_ply(folder / "wainscot.ply", room.wainscot())
    write_ply(folder / "cornice.ply", room.cornice())
    top, foot = room.table()
    write_ply(folder / "table_top.ply", top)
    write_ply(folder / "table_foot.ply", foot)
    write_ply(folder / "wall_lamp.ply", room.wall_lamp())
    x, y, w, h = room.PICTURE
    outline = np.array([(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)])
    write_ply(folder / "frame.ply", [sweep(outline, room.MOULDING).moved(z=room.BACK)])
    canvas = rectangle((x - w, y - h, room.BACK + 0.006), (2 * w, 0, 0), (0, 2 * h, 0))
    write_ply(folder / "picture.ply", [canvas])

    save_jpeg(folder / "oak.jpg", planed_wood((room.WOOD,) * 2, (1024, 1024), OAK, 0.21), shrink=2)
    mahogany = planed_wood((room.WOOD,) * 2, (1024, 1024), MAHOGANY)
    save_jpeg(folder / "mahogany.jpg", mahogany, shrink=2)
    extent = (2 * room.HALF_WIDTH, room.FRONT - room.BACK)
    save_jpeg(folder / "boards.jpg", floor_boards(extent, (1520, 1580)), shrink=2, quality=80)
    save_jpeg(folder / "picture.jpg", hills(600, 440), shrink=2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of Veach Egg.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
