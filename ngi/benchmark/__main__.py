"""Entry point of `python -m ngi.benchmark` and `ngi-benchmark`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import ngi.benchmark
from ngi.backend import activate, describe
from ngi.benchmark.figures import Figure, table
from ngi.benchmark.generation import generation, leaving_out
from ngi.benchmark.store import store
from ngi.benchmark.training import training
from ngi.memory import keep_freed_memory
from ngi.provenance import provenance
from ngi.scene import scenes

NETWORKS = ((512, 8, True), (128, 6, False), (128, 6, True))
"""Hidden features, hidden layers, bf16: the paper's network, and the demo's."""
STORED_PATCHES = 1024
PARTS = ("generation", "training", "store", "leaving-out")


def measure(part: str, names: Sequence[str], samples_per_pixel: int, repeats: int) -> list[Figure]:
    """The figures of one part of the benchmark; names: of scenes, none for the part's own."""
    if part == "generation":
        return [
            figure
            for name in names or ["sphere-caustic"]
            for figure in generation(name, samples_per_pixel, repeats)
        ]
    if part == "training":
        return [figure for network in NETWORKS for figure in training(*network, repeats=repeats)]
    if part == "store":
        return [
            figure
            for dimensions in (12, 128)
            for figure in store(dimensions=dimensions, count=STORED_PATCHES, repeats=repeats)
        ]
    return [
        figure
        for name in names or sorted(scenes())
        for figure in leaving_out(name, samples_per_pixel, repeats)
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `python -m ngi.benchmark` and `ngi-benchmark`."""
    parser = argparse.ArgumentParser(prog="ngi.benchmark", description=ngi.benchmark.__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all")
    parser.add_argument("--scenes", nargs="+", default=[], metavar="NAME", help="scenes to render")
    parser.add_argument("--samples-per-pixel", type=int, default=64)
    parser.add_argument("--repeats", type=int, default=20, help="timings per figure")
    parser.add_argument("--output", type=Path, default=Path("outputs/benchmark.json"))
    chosen = parser.parse_args(arguments)
    for kind, names, known in (("part", chosen.parts, PARTS), ("scene", chosen.scenes, scenes())):
        if unknown := sorted(set(names) - set(known)):
            parser.error(f"no {kind} {', '.join(unknown)}; there are {', '.join(sorted(known))}")
    keep_freed_memory()
    figures = [
        figure
        for part in chosen.parts or PARTS
        for figure in measure(part, chosen.scenes, chosen.samples_per_pixel, chosen.repeats)
    ]
    print(table(figures))
    chosen.output.parent.mkdir(parents=True, exist_ok=True)
    report = {**provenance(backend=describe(activate())), "figures": [asdict(f) for f in figures]}
    chosen.output.write_text(json.dumps(report, indent=2))
    print(f"\nwritten to {chosen.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
