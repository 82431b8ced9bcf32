"""Looks for scenes and runs that are read wrongly: `python -m tests.fuzz --inputs 10000`."""

from __future__ import annotations

import argparse
import logging
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from ngi.scene import SceneDescription
from tests.fuzz.fuzzer import LONGEST, fuzz

MEMORY = 2 << 30


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--build", action="store_true", help="load what can be read into Mitsuba")
    options = parser.parse_args()
    use, longest = (_build, 12 * LONGEST) if options.build else (lambda _: None, LONGEST)
    logging.disable(logging.WARNING)  # of what is read although it is odd
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    numbers = range(options.first, options.first + options.inputs)
    places: Counter[str] = Counter()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for bug in fuzz(numbers, Path(folder) / "kit", use=use, longest=longest):
            places[bug.place] += 1
            if places[bug.place] == 1:
                print(f"--- input {bug.number}\n{bug.what}", flush=True)
    for place, count in places.most_common():
        print(f"{count:6}  {place}")
    seconds = time.monotonic() - begun
    print(f"{options.inputs} inputs, {len(places)} bugs, {options.inputs / seconds:.0f} inputs/s")
    return 1 if places else 0


def _build(description: SceneDescription) -> None:
    from ngi.machine.backend import activate
    from ngi.scene.variable_scene import VariableScene

    activate("scalar")
    VariableScene(description).apply([0.5] * description.dimensions)


if __name__ == "__main__":
    sys.exit(main())
