"""Finished runs, one of which is damaged, and what a report makes of them."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from analysis.claim_tables import claims_table
from analysis.doubts import comparison_warnings
from analysis.exploration import exploration_table
from analysis.frame_times import frame_table
from analysis.methods import name_methods
from analysis.pairs import ways_left_out
from analysis.phases import phase_table
from analysis.provenance import provenance_table
from analysis.runs import Run, check_comparable, find_runs
from analysis.summary import compare, summarise
from analysis.tables import comparison_table, cost_table, error_table, to_markdown
from analysis.time_table import time_table
from analysis.verdicts import judge
from tests.analysis.conftest import method_maker, run_maker
from tests.analysis.traces import write_logs
from tests.fuzz.mutations import VALUES, in_letters, in_lines, in_tree

LOGS = ("metrics.csv", "steps.csv", "chains.bin")
UNCHECKED = "of before checksums: "
"""Begins the kinds of runs whose result file names neither lengths nor checksums."""

RUN_FILES = ("result.json", *LOGS, *(UNCHECKED + name for name in LOGS))
DAMAGED = Path("living-room/of uniform_uniform/seed=1")


@cache
def good_files() -> dict[str, bytes]:
    """Content of the files that are damaged, by their names."""
    with TemporaryDirectory() as folder:
        write_runs(Path(folder))
        return {name: (Path(folder) / DAMAGED / name).read_bytes() for name in RUN_FILES[:4]}


def write_runs(folder: Path) -> None:
    """Two methods with two seeds each."""
    make = method_maker(run_maker(folder))
    for seed in (0, 1):
        for method in ("uniform", "active_exploration"):
            write_logs(make(method, seed=seed))


def damaged(random: Random, kind: str) -> bytes:
    """A file of a run cut short, or with something else in it."""
    text = good_files()[kind.removeprefix(UNCHECKED)]
    draw = random.random()
    if draw < 0.4:
        lines = text.splitlines(keepends=True)
        whole = b"".join(lines[: random.randrange(len(lines))])
        return random.choice((whole, text[: random.randrange(len(text))]))
    if kind == "result.json" and draw < 0.9:
        return in_tree(random, text, json.loads, _to_json)
    if kind.endswith("csv") and draw < 0.8:
        return _cells(random, text)
    return random.choice((in_letters, in_lines))(random, text)


def read_damaged(folder: Path, kind: str, text: bytes) -> None:
    """Reports on the runs. Raises AssertionError where damage is not noticed."""
    if not (folder / "runs").exists():
        write_runs(folder / "runs")
    run, name = folder / "runs" / DAMAGED, kind.removeprefix(UNCHECKED)
    whole = good_files()
    if kind != name:
        (run / "result.json").write_text(
            json.dumps({k: v for k, v in json.loads(whole["result.json"]).items() if k != "logs"})
        )
    (run / name).write_bytes(text)
    try:
        runs, warnings = find_runs(folder / "runs")
        left_out = [warning for warning in warnings if f"left out: {run}: " in warning]
        assert len(runs) + len(left_out) == 4, "a run is lost"
        assert kind not in LOGS or text == whole[name] or left_out, "damage is not noticed"
        _report(runs)
    finally:
        shutil.rmtree(run)
        write_one = folder / "again"
        write_runs(write_one)
        shutil.move(write_one / DAMAGED, run)
        shutil.rmtree(write_one)


def _report(runs: Sequence[Run]) -> None:
    """All numbers of a report, no pictures."""
    runs = name_methods(runs)
    warnings.simplefilter("ignore", RuntimeWarning)  # of NaN and what is too large to be squared
    check_comparable(runs)
    comparison_warnings(runs)
    ways_left_out(runs)
    summaries = summarise(runs)
    tables = [error_table(summaries), cost_table(summaries), claims_table(judge(runs))]
    tables += [frame_table(runs), phase_table(runs), time_table(runs), exploration_table(runs)]
    tables += [provenance_table(runs), comparison_table(compare(summaries))]
    for table in tables:
        to_markdown(table)


def _cells(random: Random, text: bytes) -> bytes:
    """A CSV file with another value in some of its cells, or with a row or column less."""
    rows = [line.split(b",") for line in text.splitlines()]
    for _ in range(random.choice((1, 1, 2, 10))):
        row = random.choice(rows)
        row[random.randrange(len(row))] = _to_json(random.choice(VALUES))
    if random.random() < 0.3:
        column = random.randrange(len(rows[0]))
        rows = [row[:column] + row[column + 1 :] for row in rows]
    return b"\n".join(b",".join(row) for row in rows) + b"\n"


def _to_json(value: Any) -> bytes:
    return json.dumps(value).encode()
