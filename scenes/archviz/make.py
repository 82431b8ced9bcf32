"""Makes the living room beside itself: `python scenes/archviz/make.py`.

- scene.xml; scene.yaml with what varies (its camera path and hard frames: frames.py)
- <piece>_<material>.ply: the meshes of a piece of furniture, one file for each material
- planks, oak, walnut, marble: floor and veneers; rug_*, shapes_*, hills_*: rugs and pictures to
  choose from; garden.jpg: what is outside

Raises ValueError if a piece could enter another for some value of the variables (clearance.py).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

from artwork import garden, hills_picture, marble, planks, rug, shapes_picture, wood
from clearance import check
from modelling.furniture import write_parts
from modelling.textures import save_jpeg
from rooms import MOVERS, static_parts
from scene_file import scene_xml
from variables import scene_yaml

TEXTURED = ("wood", "oak", "marble")

WALNUT = ((84, 54, 36), (146, 100, 66))  # sRGB, dark and light
OAK = ((150, 112, 76), (206, 168, 122))


def write_images(folder: Path) -> None:
    save_jpeg(folder / "planks.jpg", planks((2.8, 2.2), (1792, 1408)), shrink=2, quality=80)
    save_jpeg(folder / "oak.jpg", wood(768, *OAK), shrink=2, quality=80)
    save_jpeg(folder / "walnut.jpg", wood(768, *WALNUT), shrink=2, quality=80)
    save_jpeg(folder / "marble.jpg", marble(512), quality=80)
    save_jpeg(folder / "garden.jpg", garden((1024, 512)), quality=80)
    for i in range(3):
        save_jpeg(folder / f"rug_{i}.jpg", rug(i, (928, 640)), shrink=2, quality=75)
        save_jpeg(folder / f"hills_{i}.jpg", hills_picture(i, (768, 576)), shrink=2)
    for i in range(4):
        save_jpeg(folder / f"shapes_{i}.jpg", shapes_picture(i, (512, 640)), shrink=2)


def make(folder: Path) -> None:
    """Writes everything into `folder`."""
    check()
    files = {"room": write_parts(folder, "room", static_parts(), TEXTURED)}
    for mover in MOVERS.values():
        for name, parts in mover.pieces.items():
            files[name] = write_parts(folder, name, parts, TEXTURED)
    write_images(folder)
    (folder / "scene.xml").write_text(scene_xml(files))
    (folder / "scene.yaml").write_text(scene_yaml())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the living room with a dining area.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
