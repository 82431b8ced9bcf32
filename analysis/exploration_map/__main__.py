"""Entry point: `python -m analysis.exploration_map FOLDER`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from analysis.command import errors_in_a_line
from analysis.exploration_map.curves import write_curves
from analysis.exploration_map.heat_maps import REUSE, write_heat_maps
from analysis.exploration_map.runs import ERRORS, read_table
from analysis.exploration_map.tables import break_even_table, speedup_table, speedups
from analysis.files import write
from analysis.latex import to_latex
from analysis.tables import to_markdown


def write_map(folder: Path, output: Path) -> list[Path]:
    """Reads the map's runs in `folder`, writes tables and figures into `output`; their paths.

    Raises ValueError where there are no runs.
    """
    table = read_table(folder)
    found = speedups(table)
    output.mkdir(parents=True, exist_ok=True)
    csv, markdown, latex = (output / f"speedups.{suffix}" for suffix in ("csv", "md", "tex"))
    write(csv, found.to_csv(index=False, float_format="%.4g"))
    tables = [
        make(found, error=error, reuse=reuse)
        for error, make, reuse in product(ERRORS, (speedup_table, break_even_table), REUSE)
    ]
    write(markdown, "\n\n".join(map(to_markdown, tables)) + "\n")
    write(latex, "\n\n".join(map(to_latex, tables)) + "\n")
    return [
        csv,
        markdown,
        latex,
        *write_heat_maps(found, output),
        *write_curves(table, found, output),
    ]


@errors_in_a_line
def main(argv: Sequence[str] | None = None) -> int:
    """Draws the map; returns the exit status, 1 where there is nothing to draw."""
    parser = argparse.ArgumentParser(
        prog="python -m analysis.exploration_map",
        description="Draws the map of when exploration pays from the runs that "
        "`python -m ngi.studies.exploration_map` left in FOLDER: heat maps, a panel per knob, "
        "error curves (.png, .svg, .pdf), and every ratio of run times (.csv, .md, .tex).",
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument(
        "--output", metavar="PATH", type=Path, help="where to write; by default FOLDER/map"
    )
    arguments = parser.parse_args(argv)
    files = write_map(arguments.folder, arguments.output or arguments.folder / "map")
    print("Written:")
    for file in files:
        print(f"  {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
