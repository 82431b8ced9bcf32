"""Entry point of `ngi benchmark`.

The processes that parts start import this file: what they do not need is imported in functions.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import ngi.studies.benchmark
from ngi.config.options import option, run_tool
from ngi.scene import scenes
from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.part import TRAINING, Options, Part
from ngi.studies.benchmark.scenes import Scene, one_per_folder, released, shipped
from ngi.studies.benchmark.tables import markdown, table

SHORT = ("living-room", "salon-25", "sphere-caustic")
"""Scenes of a run that names neither parts nor scenes, which is to take a quarter of an hour."""


@dataclass
class BenchmarkOptions:
    parts: list[str] | None = option("what to measure, see above; default: everything", None)
    scenes: list[str] | None = option("scenes to render", None)
    release: list[str] | None = option("folders of the authors' scenes to render", None)
    samples_per_pixel: str | None = option(f"a number, or '{TRAINING}'", None)
    patches: int | None = option("number of patches that compilations and memory render", None)
    repeats: int = option("timings per figure", 20)
    seconds: float = option("for timings, per scene", 60.0)
    markdown: bool = option("print the tables as Markdown too", False)
    output: str = option("file to write", "outputs/benchmark.json")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi benchmark`."""
    from ngi.studies.benchmark.parts import PARTS

    known = [f"    {part.name:<14}{part.help}" for part in PARTS]
    BenchmarkOptions.__doc__ = "\n".join([f"{ngi.studies.benchmark.__doc__}\nparts:", *known])
    return run_tool(benchmark, BenchmarkOptions, "ngi benchmark", arguments)


def benchmark(chosen: BenchmarkOptions) -> None:
    """Measures, prints and writes. Raises ValueError and FileNotFoundError for what is not there,
    before anything is measured.
    """
    from ngi.studies.benchmark.parts import PARTS

    parts, given = {part.name: part for part in PARTS}, chosen.parts or []
    for kind, names, known in (("part", given, parts), ("scene", chosen.scenes or [], scenes())):
        if unknown := sorted(set(names) - set(known)):
            there = ", ".join(sorted(known))
            raise ValueError(f"no {kind} {', '.join(unknown)}; there are {there}")
    for key in ("repeats", "patches"):
        if (number := getattr(chosen, key)) is not None and number < 1:
            raise ValueError(f"{key}: {number} is not positive")
    named = [*shipped(chosen.scenes or []), *map(released, map(Path, chosen.release or []))]
    every = one_per_folder()
    if not given and not named:
        others = sorted({*every} - {*SHORT})
        print(f"left out: the scenes {', '.join(others)}; name parts or scenes to measure them")
        every = list(SHORT)
    Path(chosen.output).parent.mkdir(parents=True, exist_ok=True)
    figures = _measure([parts[name] for name in given] or PARTS, chosen, named, every)
    if chosen.markdown:
        print(markdown(figures))


def _measure(
    parts: Sequence[Part], chosen: BenchmarkOptions, named: list[Scene], every: list[str]
) -> list[Figure]:
    """named: the scenes asked for; every: those of a part that renders all, where none were."""
    samples = _samples(chosen.samples_per_pixel)
    figures: list[Figure] = []
    try:
        for part in parts:
            options = Options(
                scenes=named or shipped(every if part.scenes is None else part.scenes),
                samples_per_pixel=samples,
                repeats=chosen.repeats,
                seconds=chosen.seconds,
                patches=chosen.patches,
            )
            start = len(figures)
            for figure in part.figures(options):
                figures.append(figure)  # one at a time: what was measured before an error stays
            print(f"{table(figures[start:])}\n", flush=True)
    finally:
        if figures:
            _write(figures, Path(chosen.output))
    return figures


def _write(figures: Sequence[Figure], output: Path) -> None:
    from ngi.files.durable import write_atomically
    from ngi.machine.backend import activate, describe
    from ngi.machine.provenance import provenance

    report = {**provenance(backend=describe(activate())), "figures": [asdict(f) for f in figures]}
    write_atomically(output, json.dumps(report, indent=2).encode())
    print(f"written to {output}")


def _samples(text: str | None) -> int | str | None:
    if text in (None, TRAINING):
        return text
    if not text.isdecimal() or not int(text):
        raise ValueError(f"samples_per_pixel: '{text}' is neither positive nor '{TRAINING}'")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
