"""Makes the assets of the room behind the shutters beside itself: `python scenes/shutters/make.py`.

- outer_shutter.ply, inner_shutter.ply: plates with a round hole each, about the hole
- lamp_wall.ply, window_frame.ply: the wall with the round window behind which they slide
- vase.ply, column.ply: what stands in the room, about the origin
- trim.ply: skirting boards and the panels of the back wall
- boards.jpg: the floor, 3.3 m by 3 m

Lengths are metres; the room spans x in [-1.62, 1.68], y in [0, 2.6], z in [-1.5, 1.5].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

from modelling.meshes import Mesh, box, box_frame, sweep, turned, write_ply
from modelling.ornaments import vase
from modelling.textures import floor_boards, save_jpeg

ROOM_MINIMUM = np.array([-1.62, 0.0, -1.5])
ROOM_MAXIMUM = np.array([1.68, 2.6, 1.5])

WINDOW = (1.82, 0.36)
"""Height of its centre on the lamp's wall, and its radius."""

SHUTTER_HALF_SIZE = 0.95
HOLES = {"outer_shutter": 0.05, "inner_shutter": 0.055}
"""Radii. Where they are in line, the lamp's light comes through as a cone 30 degrees wide."""

COLUMN = [(0.19, 0.0), (0.19, 0.05), (0.14, 0.08), (0.12, 0.62), (0.16, 0.66), (0.16, 0.7)]
"""(radius, height) from bottom to top."""

EVENLY = np.linspace(-np.pi, np.pi, 48, endpoint=False)

MOULDING = [(0.0, 0.0), (0.0, 0.02), (0.02, 0.035), (0.045, 0.02), (0.045, 0.0)]


def circle(radius: float, angles: np.ndarray) -> np.ndarray:
    """Points [n, 2], counter-clockwise if the angles (radians) increase."""
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def plate(lower: tuple[float, float], upper: tuple[float, float], hole: float) -> Mesh:
    """A rectangle in the plane x = 0 that faces +x, with a round hole of this radius about 0.

    lower, upper: its corners in y and z
    """
    corners = [np.arctan2(z, y) for y in (lower[0], upper[0]) for z in (lower[1], upper[1])]
    angles = np.unique(np.concatenate([EVENLY, corners]).round(9))
    inner = circle(hole, angles)
    with np.errstate(divide="ignore"):
        reach = np.maximum(upper / inner, lower / inner)  # along a ray, in radii of the hole
    outer = inner * reach.min(axis=1, keepdims=True)
    ring = np.arange(len(angles))
    following, offset = np.roll(ring, -1), len(angles)
    faces = [(ring, following, offset + ring), (following, offset + following, offset + ring)]
    points = np.insert(np.concatenate([outer, inner]), 0, 0.0, axis=1)
    return Mesh(points, np.concatenate([np.stack(corner, axis=1) for corner in faces]))


def lamp_wall() -> list[Mesh]:
    """The wall x = -1.62 around its window."""
    height, radius = WINDOW
    lower = (ROOM_MINIMUM[1] - height, ROOM_MINIMUM[2])
    upper = (ROOM_MAXIMUM[1] - height, ROOM_MAXIMUM[2])
    return [plate(lower, upper, radius).moved(ROOM_MINIMUM[0], height)]


def window_frame() -> list[Mesh]:
    height, radius = WINDOW
    return [sweep(circle(radius, EVENLY), MOULDING).rotated("y", 90).moved(ROOM_MINIMUM[0], height)]


def trim() -> list[Mesh]:
    """Skirting boards along three walls, and three panels on the back wall."""
    (x0, _, z0), (x1, _, z1) = ROOM_MINIMUM, ROOM_MAXIMUM
    boards = [
        box((x0, 0, z0), (x1, 0.13, z0 + 0.02)),
        box((x1 - 0.02, 0, z0 + 0.02), (x1, 0.13, z1)),
        box((x0, 0, z0 + 0.02), (x0 + 0.02, 0.13, z1)),
    ]
    for left, right in ((-1.42, -0.55), (-0.4, 0.46), (0.61, 1.48)):
        boards += box_frame(left, right, 0.3, 2.2, back=z0, width=0.03, depth=0.018)
    return boards


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    half = SHUTTER_HALF_SIZE
    for name, hole in HOLES.items():
        write_ply(folder / f"{name}.ply", [plate((-half, -half), (half, half), hole)])
    write_ply(folder / "lamp_wall.ply", lamp_wall())
    write_ply(folder / "window_frame.ply", window_frame())
    write_ply(folder / "vase.ply", [vase("amphora").scaled(1.5, 1.5, 1.5).moved(y=COLUMN[-1][1])])
    write_ply(folder / "column.ply", [turned(COLUMN, 48)])
    write_ply(folder / "trim.ply", trim())
    extent = ROOM_MAXIMUM - ROOM_MINIMUM
    save_jpeg(folder / "boards.jpg", floor_boards((extent[0], extent[2]), (1320, 1200)), shrink=2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the room behind the shutters.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
