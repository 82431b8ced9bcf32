"""Makes the assets of the mirror room beside itself: `python scenes/mirror/make.py`.

- hare.ply, plinth.ply: the figure (hare.py) and what it stands on, about the origin
- mirror.ply, mirror_frame.ply: an arched mirror and its moulding
- paintings.ply, paintings.jpg, picture_frames.ply: three paintings on the opposite wall
- trim.ply: skirting boards, dado rail and cornice
- boards.jpg: the floor, 6.8 m by 4.8 m

Lengths are metres; the room spans x in [-3.4, 3.4], y in [0, 2.8], z in [-2.2, 2.6].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.append(str(Path(__file__).parents[1]))

from hare import hare
from landscape import PALETTES, landscape
from modelling.meshes import Mesh, box, sweep, turned, write_ply
from modelling.textures import floor_boards

ROOM_MINIMUM = np.array([-3.4, 0.0, -2.2])
ROOM_MAXIMUM = np.array([3.4, 2.8, 2.6])

MIRROR_HALF_WIDTH = 0.27
MIRROR_BOTTOM, MIRROR_SPRING = 0.62, 1.83  # the arch springs here and rises by the half width

PLINTH_HEIGHT = 0.55
PLINTH = [(0.27, 0.0), (0.27, 0.06), (0.235, 0.085), (0.235, 0.465), (0.28, 0.5), (0.28, 0.55)]
"""Distance of the corners from the axis, and height, from bottom to top."""

PAINTINGS = ((-1.75, 1.6, 0.4, 0.5), (0.0, 1.6, 0.55, 0.5), (1.75, 1.6, 0.4, 0.5))
"""Centre x, centre y, half width and half height of each painting."""

MOULDING = [(0.0, 0.0), (0.0, 0.02), (0.012, 0.03), (0.03, 0.024), (0.05, 0.04), (0.06, 0.0)]
"""Profile of every frame: distances from its inner edge and from the wall."""


def rectangle_outline(x: float, y: float, half_width: float, half_height: float) -> np.ndarray:
    """Corners [4, 2], counter-clockwise."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    return np.array([x, y]) + corners * np.array([half_width, half_height])


def arch_outline() -> np.ndarray:
    """The mirror's outline [35, 2], counter-clockwise: two bottom corners, then the round arch."""
    angle = np.pi * np.arange(33) / 32
    arch = np.stack([np.cos(angle), np.sin(angle)], axis=1) * MIRROR_HALF_WIDTH
    bottom = [(-MIRROR_HALF_WIDTH, MIRROR_BOTTOM), (MIRROR_HALF_WIDTH, MIRROR_BOTTOM)]
    return np.concatenate([bottom, arch + np.array([0, MIRROR_SPRING])])


def pane(outline: np.ndarray, texture: np.ndarray | None = None) -> Mesh:
    """A convex outline [n, 2] filled by a fan of triangles, one centimetre before the wall."""
    vertices = np.concatenate([outline, np.full((len(outline), 1), 0.01)], axis=1)
    fan = [(0, i, i + 1) for i in range(1, len(outline) - 1)]
    return Mesh(vertices, np.array(fan), texture=texture)


def on_mirror_wall(mesh: Mesh) -> Mesh:
    """From the plane z = 0 to the wall that faces +z."""
    return Mesh(mesh.vertices + np.array([0, 0, ROOM_MINIMUM[2]]), mesh.faces)


def on_painting_wall(mesh: Mesh) -> Mesh:
    """From the plane z = 0 to the wall that faces -z: half a turn about y."""
    turned = mesh.vertices * np.array([-1, 1, -1]) + np.array([0, 0, ROOM_MAXIMUM[2]])
    return Mesh(turned, mesh.faces, texture=mesh.texture)


def painting(index: int) -> Mesh:
    """One canvas; the paintings share an image, side by side."""
    left, right = index / len(PAINTINGS), (index + 1) / len(PAINTINGS)
    # The v axis of Mitsuba's bitmaps points down.
    texture = np.array([(left, 1), (right, 1), (right, 0), (left, 0)])
    return on_painting_wall(pane(rectangle_outline(*PAINTINGS[index]), texture))


def wall_strip(bottom: float, top: float, depth: float, gap: float = 0.0) -> list[Mesh]:
    """A board of the given depth along all four walls; it leaves |x| < gap of the mirror's free."""
    (x0, _, z0), (x1, _, z1) = ROOM_MINIMUM, ROOM_MAXIMUM
    return [
        box((x0, bottom, z0), (-gap, top, z0 + depth)),
        box((gap, bottom, z0), (x1, top, z0 + depth)),
        box((x0, bottom, z1 - depth), (x1, top, z1)),
        box((x0, bottom, z0 + depth), (x0 + depth, top, z1 - depth)),
        box((x1 - depth, bottom, z0 + depth), (x1, top, z1 - depth)),
    ]


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    figure = hare()
    raised = figure.vertices + np.array([0, PLINTH_HEIGHT, 0])
    write_ply(folder / "hare.ply", [Mesh(raised, figure.faces, normals=figure.normals)])
    write_ply(folder / "plinth.ply", [turned(PLINTH, segments=8)])

    write_ply(folder / "mirror.ply", [on_mirror_wall(pane(arch_outline()))])
    write_ply(folder / "mirror_frame.ply", [on_mirror_wall(sweep(arch_outline(), MOULDING))])
    frames = [sweep(rectangle_outline(*place), MOULDING) for place in PAINTINGS]
    write_ply(folder / "picture_frames.ply", [on_painting_wall(frame) for frame in frames])
    write_ply(folder / "paintings.ply", [painting(index) for index in range(len(PAINTINGS))])
    skirting, cornice = wall_strip(0.0, 0.16, 0.02), wall_strip(2.72, 2.8, 0.06)
    dado_rail = wall_strip(0.78, 0.81, 0.025, gap=MIRROR_HALF_WIDTH + MOULDING[-1][0])
    write_ply(folder / "trim.ply", skirting + dado_rail + cornice)

    canvases = [landscape(index, 512) for index in range(len(PALETTES))]
    paintings = Image.fromarray(np.concatenate(canvases, axis=1))
    paintings.resize((768, 256), Image.Resampling.BOX).save(folder / "paintings.jpg", quality=88)
    extent = (ROOM_MAXIMUM - ROOM_MINIMUM)[[0, 2]]
    boards = Image.fromarray(floor_boards((extent[0], extent[1]), (2040, 1440)))
    boards.resize((1020, 720), Image.Resampling.BOX).save(folder / "boards.jpg", quality=82)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the mirror room.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
