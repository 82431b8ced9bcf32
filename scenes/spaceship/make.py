"""Makes the assets of the spaceship's bridge beside itself: `python scenes/spaceship/make.py`.

Files named after a material (steel.ply, leather.ply, …) hold everything that is made of it. The
others: hull.ply, deck.ply and screens.ply with their images, space.jpg for what is outside.

Lengths are metres; the bridge spans x in [-2.9, 2.9], y in [0, 2.6], z in [-3, 2.9], bow at -z.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

import hull
import starscape
from fittings import controls, screen_frames, screens, seats, window_rail
from modelling.furniture import Parts, finished, merged
from modelling.meshes import Mesh, box, write_ply
from modelling.textures import save_jpeg
from orb_table import chart_table, lamp_housing, orb


def light_housings() -> list[Mesh]:
    """Frames around the two ceiling lights."""
    frames = []
    for x in (-0.95, 0.95):
        left, right, front, back = x - 0.17, x + 0.17, -0.95, 1.35
        frames += [
            box((left - 0.05, 2.54, front - 0.05), (left, 2.61, back + 0.05)),
            box((right, 2.54, front - 0.05), (right + 0.05, 2.61, back + 0.05)),
            box((left, 2.54, front - 0.05), (right, 2.61, front)),
            box((left, 2.54, back), (right, 2.61, back + 0.05)),
        ]
    return frames


def make(folder: Path) -> None:
    """Writes every asset into `folder`."""
    structure: Parts = {
        "console": hull.consoles(),
        "rib": hull.ribs() + window_rail() + light_housings(),
        "plastic": screen_frames(),
        "stripe": hull.stripes(),
    }
    pieces = chart_table(), lamp_housing(), seats(), controls(), hull.rear_bulkhead()
    parts = merged(structure, *pieces)
    for material, meshes in parts.items():
        write_ply(folder / f"{material}.ply", [finished(mesh, textured=False) for mesh in meshes])
    write_ply(folder / "hull.ply", hull.panelling())
    write_ply(folder / "panes.ply", hull.panes())
    write_ply(folder / "deck.ply", [hull.fan(hull.wall_points(0.0))])
    write_ply(folder / "screens.ply", screens())
    write_ply(folder / "orb.ply", [finished(orb(), textured=False)])

    save_jpeg(folder / "hull.jpg", starscape.hull_panels(1024), shrink=2, quality=80)
    save_jpeg(folder / "deck.jpg", starscape.deck_plates(1536), shrink=2, quality=78)
    save_jpeg(folder / "screens.jpg", starscape.displays(), quality=85)
    save_jpeg(folder / "space.jpg", starscape.outer_space(1024), quality=88)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the assets of the spaceship's bridge.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
