"""Entry point of `ngi benchmark` and `python -m ngi.benchmark`.

The processes that parts start import this file: what they do not need is imported in functions.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import ngi.studies.benchmark
from ngi.machine.memory import keep_freed_memory
from ngi.scene import scenes
from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.part import TRAINING, Options, Part
from ngi.studies.benchmark.scenes import Scene, one_per_folder, released, shipped
from ngi.studies.benchmark.tables import markdown, table

SHORT = ("living-room", "salon-25", "sphere-caustic")
"""Scenes of a run that names neither parts nor scenes, which is to take a quarter of an hour."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi benchmark` and `python -m ngi.benchmark`."""
    from ngi.studies.benchmark.parts import PARTS

    parser = _parser(PARTS)
    chosen = parser.parse_args(arguments)
    parts = {part.name: part for part in PARTS}
    for kind, names, known in (("part", chosen.parts, parts), ("scene", chosen.scenes, scenes())):
        if unknown := sorted(set(names) - set(known)):
            parser.error(f"no {kind} {', '.join(unknown)}; there are {', '.join(sorted(known))}")
    try:
        named = [*shipped(chosen.scenes), *map(released, chosen.release)]
    except FileNotFoundError as error:
        parser.error(f"--release {error}")
    every = one_per_folder()
    if not chosen.parts and not named:
        others = sorted({*every} - {*SHORT})
        print(f"left out: the scenes {', '.join(others)}; name parts or scenes to measure them")
        every = list(SHORT)
    measured = [parts[name] for name in chosen.parts] or PARTS
    figures = _measure(measured, chosen, named, every)
    if chosen.markdown:
        print(markdown(figures))
    return 0


def _measure(
    parts: Sequence[Part], chosen: argparse.Namespace, named: list[Scene], every: list[str]
) -> list[Figure]:
    """named: the scenes asked for; every: those of a part that renders all, where none were."""
    keep_freed_memory()
    figures: list[Figure] = []
    try:
        for part in parts:
            options = Options(
                scenes=named or shipped(every if part.scenes is None else part.scenes),
                samples_per_pixel=chosen.samples_per_pixel,
                repeats=chosen.repeats,
                seconds=chosen.seconds,
                patches=chosen.patches,
            )
            start = len(figures)
            for figure in part.figures(options):
                figures.append(figure)  # one at a time: what was measured before an error stays
            print(f"{table(figures[start:])}\n", flush=True)
    finally:
        _write(figures, chosen.output)
    return figures


def _write(figures: Sequence[Figure], output: Path) -> None:
    from ngi.machine.backend import activate, describe
    from ngi.machine.provenance import provenance

    output.parent.mkdir(parents=True, exist_ok=True)
    report = {**provenance(backend=describe(activate())), "figures": [asdict(f) for f in figures]}
    output.write_text(json.dumps(report, indent=2))
    print(f"written to {output}")


def _parser(parts: Sequence[Part]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ngi benchmark",
        description=ngi.studies.benchmark.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="\n".join(["parts:", *(f"  {part.name:<14}{part.help}" for part in parts)]),
    )
    add = parser.add_argument
    add("parts", nargs="*", metavar="PART", help="what to measure, see below; everything")
    add("--scenes", nargs="+", default=[], metavar="NAME", help="scenes to render")
    add("--release", nargs="+", default=[], type=Path, metavar="FOLDER", help="the authors' scenes")
    add("--samples-per-pixel", type=_samples, metavar="N", help=f"a number, or '{TRAINING}'")
    add("--patches", type=_positive, metavar="N", help="rendered by compilations and memory")
    add("--repeats", type=_positive, default=20, metavar="N", help="timings per figure; 20")
    add("--seconds", type=float, default=60.0, metavar="S", help="of timings per scene; 60")
    add("--markdown", action="store_true", help="print the tables as Markdown too")
    add("--output", type=Path, default=Path("outputs/benchmark.json"), metavar="FILE")
    return parser


def _positive(text: str) -> int:
    if (number := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"{number} is not positive")
    return number


def _samples(text: str) -> int | str:
    return text if text == TRAINING else _positive(text)


if __name__ == "__main__":
    sys.exit(main())
