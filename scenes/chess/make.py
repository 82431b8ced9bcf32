"""Makes the chess scene beside itself: `python scenes/chess/make.py`.

- scene.xml: stage.xml with the 12 groups and 32 instances of the men put in
- scene.yaml: 128 variables, test frames and path (games.py)
- pawn.ply … king.ply: the six kinds of men (chessmen.py)
- files named after a material (walnut.ply, brass.ply, …): what is made of it
- squares.ply, board.jpg: the squares; walnut.jpg: a square metre of wood

Lengths are metres; the room spans x in [-2.2, 2], y in [0, 2.6], z in [-2, 2.2].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

import study
from chessmen import KINDS, MAKERS
from games import CAMERA_PATH, HARD_FRAMES
from modelling.furniture import finished, merged
from modelling.meshes import write_ply
from modelling.textures import save_jpeg
from position import BOARD_TOP, men

GROUP = """    <shape type="shapegroup" id="{colour}_{kind}">
        <shape type="ply" id="{colour}_{kind}_mesh">
            <string name="filename" value="{kind}.ply"/>
            <ref id="{colour}_wood"/>
        </shape>
    </shape>
"""
INSTANCE = """    <shape type="instance" id="{name}">
        <ref id="{group}"/>
        <transform name="to_world">
            <rotate y="1" angle="{turn}"/>
            <translate x="{x:.4f}" y="{y:.4f}" z="{z:.4f}"/>
        </transform>
    </shape>
"""
HEADER = """\
# Each of 32 chessmen is shifted on its squares, lifted and captured (128 dimensions).
# Written by make.py.
name: chess
scene: scene.xml
samples_per_pixel: 400
max_depth: 8
bounds: {minimum: [-2.2, 0, -2], maximum: [2, 2.6, 2.2]}
variables:
"""


def instances() -> str:
    """XML of all groups and men."""
    groups = [GROUP.format(colour=c, kind=k) for c in ("white", "black") for k in KINDS]
    placed = []
    for man in men():
        x, z = man.place
        turn = 0 if man.colour == "white" else 180
        group = f"{man.colour}_{man.kind}"
        text = INSTANCE.format(name=man.name, group=group, turn=turn, x=x, y=BOARD_TOP + 2e-4, z=z)
        placed.append(text)
    return "".join(groups + placed)


def description() -> str:
    """scene.yaml: every man's x, y, z and presence, then the frames."""
    lines = [HEADER]
    for man in men():
        low, high = ("[" + ", ".join(f"{a:g}" for a in ends) + "]" for ends in man.ranges)
        common = f"  - {{object: {man.name}, property: "
        lines.append(f"{common}translation, minimum: {low}, maximum: {high}}}\n")
        lines.append(f"{common}visibility}}\n")
    lines.append("# v: x, y (the lift), z and presence of every man in turn; in [0, 1].\n")
    for title, frames in (("camera_path", CAMERA_PATH), ("hard_frames", HARD_FRAMES)):
        lines.append(f"{title}:\n")
        for frame in frames:
            numbers = ", ".join(f"{a:g}" for a in frame().scene_vector())
            lines.append(f"  - [{numbers}]  # {frame.__name__.replace('_', ' ')}\n")
    return "".join(lines)


def make(folder: Path) -> None:
    """Writes the whole scene into `folder`."""
    for kind in KINDS:
        write_ply(folder / f"{kind}.ply", [finished(m, textured=False) for m in MAKERS[kind]()])
    parts = merged(
        {"walnut": study.board_rim() + study.table()},
        study.clock(),
        study.score_sheet(),
        study.bookcase(),
        study.floor_lamp(),
        {"white_paint": study.window_frame() + study.panelling()},
    )
    for material, meshes in parts.items():
        write_ply(
            folder / f"{material}.ply", [finished(m, textured=material == "walnut") for m in meshes]
        )
    write_ply(folder / "squares.ply", [study.squares()])
    save_jpeg(folder / "board.jpg", study.board_image(1536), shrink=2, quality=85)
    save_jpeg(folder / "walnut.jpg", study.walnut_image(1536), shrink=2, quality=82)

    stage = Path(__file__).with_name("stage.xml").read_text()
    (folder / "scene.xml").write_text(stage.replace("    <!-- the chessmen -->\n", instances()))
    (folder / "scene.yaml").write_text(description())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the chess scene.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    make(parser.parse_args().folder)
