"""Makes the assets of the bathroom beside itself: `python scenes/bathroom/make.py`.

Files named after a material (ceramic.ply, chrome.ply, …) hold everything that is made of it;
shower_glass.ply is the frosted enclosure, lamp_box.ply the housing of the lamp that moves.

Lengths are metres; the room spans x in [-1.7, 1.7], y in [0, 2.5], z in [-1.8, 1.9]. The shower is
in the corner (-x, -z), the bathtub along x = -1.7, washbasin and mirror along x = 1.7.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))

import shower
from bathroom_textures import floor_tiles, metro_tiles, shower_tiles, towel_stripes
from modelling.furniture import Parts, finished, merged, placed, rod
from modelling.meshes import Mesh, box, lathe, rectangle, rounded_box, sweep, write_ply
from modelling.ornaments import leaf, outline, rounded_profile
from modelling.textures import planed_wood, save_jpeg
from sanitary import basin_tap, bathtub, toilet, tub_tap, vanity, vessel_basin

LEFT, RIGHT, HEIGHT, BACK, FRONT = -1.7, 1.7, 2.5, -1.8, 1.9
TILED = 1.2  # height of the white tiles
METRO = (0.6, 0.6)  # metres that the image of the white tiles covers
MIRROR = (-0.62, 1.1, 0.62, 2.0)
WASHBASIN_Z, TUB, TOILET_X = 0.1, (-1.26, 0.32), 0.95
OAK = np.array([190.0, 152, 108])  # sRGB


def wall(
    start: tuple[float, float],
    end: tuple[float, float],
    low: float,
    high: float,
    tile: tuple[float, float],
) -> Mesh:
    """An upright rectangle from (x, z) to (x, z), seen with the start at the left."""
    along = (end[0] - start[0], 0, end[1] - start[1])
    mesh = rectangle((start[0], low, start[1]), along, (0, high - low, 0))
    size = np.array([np.hypot(along[0], along[2]), high - low]) / tile
    return Mesh(mesh.vertices, mesh.faces, texture=mesh.texture * size)


def walls() -> tuple[list[Mesh], list[Mesh], list[Mesh]]:
    """White tiles below, paint above, and the coloured tiles of the shower (from x = 0.1)."""
    sides = [
        ((shower.SIDE, BACK), (RIGHT, BACK)),
        ((RIGHT, BACK), (RIGHT, FRONT)),
        ((RIGHT, FRONT), (LEFT, FRONT)),
        ((LEFT, FRONT), (LEFT, shower.FRONT)),
    ]
    tiled = [wall(*side, 0, TILED, METRO) for side in sides]
    painted = [wall(*side, TILED, HEIGHT, (1, 1)) for side in sides]
    depth, width = shower.FRONT - shower.BACK, shower.SIDE - shower.LEFT
    whole = depth + width
    coloured = []
    for start, end, first, length in (
        ((LEFT, shower.FRONT), (LEFT, BACK), 0, depth),
        ((LEFT, BACK), (shower.SIDE, BACK), depth, width),
    ):
        mesh = wall(start, end, 0, HEIGHT, (length, HEIGHT))
        u = (first + mesh.texture[:, 0] * length) / whole
        texture = np.stack([u, mesh.texture[:, 1]], axis=-1)
        coloured.append(Mesh(mesh.vertices, mesh.faces, texture=texture))
    return tiled, painted, coloured


def trim() -> Parts:
    """The tiles' upper edge, a cornice, and the door behind the camera."""
    edge, top = [], []
    for low, high, depth, parts in (
        (TILED, TILED + 0.03, 0.016, edge),
        (HEIGHT - 0.05, HEIGHT, 0.04, top),
    ):
        parts += [
            box((shower.SIDE + 0.001, low, BACK), (RIGHT, high, BACK + depth)),
            box((RIGHT - depth, low, BACK + depth), (RIGHT, high, FRONT)),
            box((LEFT, low, FRONT - depth), (RIGHT - depth, high, FRONT)),
            box((LEFT, low, shower.FRONT + 0.02), (LEFT + depth, high, FRONT - depth)),
        ]
    door = [box((-0.45, 0.005, FRONT - 0.05), (0.45, 2.05, FRONT - 0.001))]
    door += [
        box((-0.36, low, FRONT - 0.06), (0.36, high, FRONT - 0.05))
        for low, high in ((0.2, 0.95), (1.1, 1.9))
    ]
    return {"green": edge, "white": top + door}


def potted_plant(leaves: int, length: float, rise: float) -> Parts:
    """A pot with a tuft of leaves, rise: degrees that the youngest stand above the horizon."""
    pot = [
        (0, 0),
        (0.06, 0),
        (0.065, 0.01),
        (0.085, 0.13),
        (0.085, 0.14),
        (0.075, 0.14),
        (0.07, 0.11),
        (0, 0.11),
    ]
    blades = [
        leaf(
            length * (1 - 0.25 * i / leaves), 0.28 * length, 12 + rise * i / leaves, 1.5, 137.5 * i
        ).moved(0, 0.11, 0)
        for i in range(leaves)
    ]
    return {"white": [lathe(rounded_profile(pot, 1), 32)], "leaf": blades}


def shelf_over_toilet() -> Parts:
    """Two oak boards with towels, bottles and a plant; the back lies at z = 0."""
    boards = [rounded_box((-0.4, y, 0.002), (0.4, y + 0.025, 0.2), 0.004, 1) for y in (1.35, 1.75)]
    folded = [
        rounded_box((-0.33, 1.377 + 0.062 * i, 0.02), (-0.03, 1.437 + 0.062 * i, 0.19), 0.028, 3)
        for i in range(3)
    ]
    parts: Parts = {"oak": boards, "red": folded[1:2], "white": [folded[0]], "blue": [folded[2]]}
    for x, height, material in ((0.1, 0.17, "green"), (0.2, 0.22, "white"), (0.3, 0.14, "yellow")):
        body, cap = shower.bottle(height, 0.032)
        spot = {material: [body], "black": [cap]}
        parts = merged(parts, placed(spot, x, 1.376, 0.1))
    return merged(parts, placed(potted_plant(17, 0.3, 70), 0.18, 1.776, 0.11))


def washing_place() -> Parts:
    """Vanity, basin, tap and mirror; the wall lies at z = 0."""
    silver = rectangle((MIRROR[0], MIRROR[1], 0.012), (1.24, 0, 0), (0, 0.9, 0))
    frame = sweep(outline(*MIRROR), [(0, 0.01), (0, 0.03), (0.018, 0.03), (0.018, 0.001)])
    lamp = box((-0.36, 2.08, 0.002), (0.36, 2.12, 0.06))
    parts: Parts = {"silvering": [silver], "black": [frame, lamp]}
    dispenser, cap = shower.bottle(0.19, 0.035)
    cup = lathe(
        [(0, 0), (0.034, 0), (0.036, 0.01), (0.036, 0.1), (0.032, 0.1), (0.031, 0.01), (0, 0.01)],
        28,
    )
    brushes = [
        rod((0.01 * s, 0.02, 0), (0.028 * s, 0.19, 0.012 * s), 0.004, 0.005, segments=8)
        for s in (-1, 1)
    ]
    return merged(
        parts,
        vanity(1.24),
        placed({"ceramic": [vessel_basin()]}, 0, 0.821, 0.26),
        placed({"chrome": basin_tap()}, 0, 0.821, 0.035),
        placed({"green": [dispenser], "black": [cap]}, -0.36, 0.821, 0.16),
        placed({"white": [cup], "red": brushes[:1], "blue": brushes[1:]}, 0.36, 0.821, 0.14),
    )


def furnishing() -> Parts:
    tub_x, tub_z = TUB
    bar = [rod((-0.28, 1.05, 0.07), (0.28, 1.05, 0.07), 0.01, segments=12)]
    bar += [rod((x, 1.05, 0.002), (x, 1.05, 0.07), 0.008) for x in (-0.26, 0.26)]
    mat = rounded_box((-0.75, 0.002, -0.72), (-0.05, 0.022, -0.24), 0.009, 2)
    return merged(
        shower.things(),
        {"chrome": shower.frame() + shower.fittings(), "terry": [mat]},
        placed(shower.stool(), -1.32, 0.109, -1.2),
        placed(shower.duck(), -1.33, 0.531, -1.18, -70),
        placed({"ceramic": [bathtub()]}, tub_x, 0.001, tub_z),
        placed({"chrome": tub_tap()}, tub_x - 0.395, 0, tub_z, 90),
        placed(toilet(), TOILET_X, 0, BACK),
        placed(shelf_over_toilet(), TOILET_X, 0, BACK),
        placed(washing_place(), RIGHT, 0, WASHBASIN_Z, -90),
        placed({"chrome": bar}, LEFT, 0.25, 0.45, 90),
        placed(potted_plant(21, 0.42, 75), 1.42, 0.001, -1.5),
        trim(),
    )


def towels() -> list[Mesh]:
    """One in the shower, one above the bathtub."""
    return [
        shower.towel(0.42, 0.8, 0.7).moved(-1.3, 1.722, BACK + 0.07),
        shower.towel(0.44, 0.55, 0.45).rotated("y", 90).moved(LEFT + 0.07, 1.302, 0.45),
    ]


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    for material, meshes in furnishing().items():
        parts = [finished(mesh, textured=material == "oak") for mesh in meshes]
        write_ply(folder / f"{material}.ply", parts)
    tiled, painted, coloured = walls()
    files = {"metro": tiled, "paint": painted, "shower_tiles": coloured, "towels": towels()}
    files["shower_glass"] = shower.panels()
    files["lamp_box"] = [box((-0.32, 0.004, -0.32), (0.32, 0.1, 0.32))]
    for name, meshes in files.items():
        write_ply(folder / f"{name}.ply", meshes)

    save_jpeg(folder / "metro.jpg", metro_tiles(6, 3, (1024, 1024)), shrink=2, quality=80)
    save_jpeg(folder / "floor.jpg", floor_tiles((5, 5), (1536, 1536)), shrink=2, quality=80)
    extent = (shower.FRONT - shower.BACK + shower.SIDE - shower.LEFT, HEIGHT)
    save_jpeg(
        folder / "shower_tiles.jpg", shower_tiles(extent, (1980, 1800), 3), shrink=2, quality=80
    )
    save_jpeg(folder / "towel.jpg", towel_stripes((512, 1024)), shrink=2)
    wood = planed_wood((1.0, 1.0), (1024, 1024), OAK)
    save_jpeg(folder / "oak.jpg", np.rot90(wood), shrink=2, quality=80)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the bathroom.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
