"""Makes box.ply, one metre long, wide and high, beside itself: `python scenes/cornell-box/make.py`.

It stands on y = 0 about the origin; scene.xml gives each of the two boxes its own size and place.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

from modelling.meshes import box, write_ply

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the asset of the Cornell box.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent, help="where to")
    write_ply(parser.parse_args().folder / "box.ply", [box((-0.5, 0, -0.5), (0.5, 1, 0.5))])
