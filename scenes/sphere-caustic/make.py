"""Makes the assets of the sphere-caustic room beside itself.

Run `python scenes/sphere-caustic/make.py`; it writes

- parquet.jpg: oak herringbone for the floor, 2 m by 4 m
- trim.ply: skirting boards, cornice and the back wall's panels, one mesh of boxes

Lengths are metres; the room spans x in [-1, 1], y in [0, 2], z in [-1, 3].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.append(str(Path(__file__).parents[1]))

from modelling.meshes import Mesh, box, box_frame, write_ply
from modelling.textures import hash_noise, value_noise

ROOM_MINIMUM = np.array([-1.0, 0.0, -1.0])
ROOM_MAXIMUM = np.array([1.0, 2.0, 3.0])

PLANK_WIDTH = 0.085
PLANK_CELLS = 5  # a plank is this many times as long as it is wide
GAP = 0.035  # half the gap between planks, in plank widths

OAK = np.array([176.0, 132.0, 88.0])  # sRGB


def parquet(width: int, height: int) -> np.ndarray:
    """Herringbone oak over 2 m x 4 m, [height, width, 3] uint8 sRGB."""
    x = (np.arange(width) + 0.5) / width * 2 / PLANK_WIDTH
    y = (np.arange(height) + 0.5) / height * 4 / PLANK_WIDTH
    x, y = np.meshgrid(x, y)
    # Planks lie at 45 degrees to the walls; the offset centres a ridge on the room's axis.
    i, j = (x + y) / np.sqrt(2) + 1000, (y - x) / np.sqrt(2) + 1000
    column, row = np.floor(i).astype(np.int64), np.floor(j).astype(np.int64)

    # Herringbone of 1 x k planks: along a row, k cells of one plank, then k crossing planks.
    step = (column - row) % (2 * PLANK_CELLS)
    lies_along_i = step < PLANK_CELLS
    before = np.where(lies_along_i, step, 2 * PLANK_CELLS - 1 - step)
    first_column = np.where(lies_along_i, column - before, column)
    first_row = np.where(lies_along_i, row, row - before)
    along = np.where(lies_along_i, i - first_column, j - first_row)
    across = np.where(lies_along_i, j - first_row, i - first_column)

    tone = hash_noise(first_column, first_row)
    shift = 97.0 * tone + 31.0 * hash_noise(first_row, first_column)
    figure = value_noise(along * 0.7 + shift, across * 5 + 3 * shift)
    grain = value_noise(along * 2.5 + 7 * shift, across * 26 + shift)
    brightness = 0.84 + 0.22 * tone + 0.16 * (figure - 0.5) + 0.10 * (grain - 0.5)
    edge = np.minimum(np.minimum(across, 1 - across), np.minimum(along, PLANK_CELLS - along))
    brightness = brightness * np.where(edge < GAP, 0.55, 1.0)

    redness = 0.06 * (hash_noise(first_column + 5, first_row - 3) - 0.5)
    tint = np.stack([1 + redness, np.ones_like(redness), 1 - redness], axis=-1)
    return np.clip(OAK * brightness[..., None] * tint, 0, 255).astype(np.uint8)


def wall_strip(bottom: float, top: float, depth: float) -> list[Mesh]:
    """A board of the given depth along all four walls."""
    (x0, _, z0), (x1, _, z1) = ROOM_MINIMUM, ROOM_MAXIMUM
    return [
        box((x0, bottom, z0), (x1, top, z0 + depth)),
        box((x0, bottom, z1 - depth), (x1, top, z1)),
        box((x0, bottom, z0 + depth), (x0 + depth, top, z1 - depth)),
        box((x1 - depth, bottom, z0 + depth), (x1, top, z1 - depth)),
    ]


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    supersampled = Image.fromarray(parquet(1536, 3072))
    supersampled.resize((512, 1024), Image.Resampling.BOX).save(folder / "parquet.jpg", quality=88)

    trim = wall_strip(0.0, 0.11, 0.02) + wall_strip(1.95, 2.0, 0.035)
    for left, right in ((-0.9, -0.52), (-0.44, 0.44), (0.52, 0.9)):
        trim += box_frame(left, right, 0.24, 1.82, back=ROOM_MINIMUM[2], width=0.028, depth=0.016)
    write_ply(folder / "trim.ply", trim)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the sphere-caustic room.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
