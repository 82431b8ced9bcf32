"""Finds the runs below a folder, reads them, and refuses to compare what cannot be compared."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

SCHEMA_VERSION = 1
"""Of the result files this program understands."""

SETS = ("hard", "uniform")
METRICS = ("mape", "dssim", "mae", "lpips")

MOST_TIME_APART = 0.05
"""Relative difference of run times up to which runs count as given the same time."""

DISTINCTIONS = ("reuse", "resolution", "model", "loss", "budget", "overrides", "experiment")
"""Label fields that tell methods of one sampler apart, the most telling first."""


@dataclass(frozen=True)
class Run:
    """One finished run: its folder, its result file, and a row of `history` per evaluation."""

    folder: Path
    result: dict[str, Any]
    history: pd.DataFrame
    method: str = ""

    @property
    def scene(self) -> str:
        return self.label["scene"]

    @property
    def label(self) -> dict[str, str]:
        return self.result["label"]

    @property
    def seed(self) -> int:
        return self.result["seed"]

    def metric(self, set_name: str, metric: str, statistic: str = "mean") -> float | None:
        """One metric at the end of the run; statistic is mean, worst5 or floor; None if missing."""
        summary = self.result["metrics"][set_name][metric]
        return None if summary is None else summary[statistic]


def find_runs(folder: Path) -> tuple[list[Run], list[str]]:
    """Every finished run below `folder`, and one warning per run that is unfinished or unreadable.

    Raises ValueError for a folder that is missing or holds no finished run, and for a result file
    of another schema version.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: there is no such folder")
    runs, warnings = [], []
    marks = ("result.json", "settings.json", "metrics.csv")
    for path in sorted({file.parent for mark in marks for file in folder.rglob(mark)}):
        try:
            runs.append(_read(path))
        except _SkippedRunError as reason:
            warnings.append(f"left out: {path}: {reason}")
    if not runs:
        found = "; ".join(warnings) or "no result.json anywhere below it"
        raise ValueError(f"{folder} holds no finished run ({found})")
    return runs, warnings


class _SkippedRunError(Exception):
    """Why a run is not part of the report."""


def _read(folder: Path) -> Run:
    file = folder / "result.json"
    if not file.exists():
        raise _SkippedRunError("unfinished, there is no result.json yet")
    try:
        result = json.loads(file.read_text())
        if not isinstance(result, dict):
            raise TypeError("it holds no object")
        version = result["schema_version"]
        if version == SCHEMA_VERSION and not result["finished"]:
            raise _SkippedRunError("unfinished")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _SkippedRunError(f"result.json cannot be read ({_describe(error)})") from error
    if version != SCHEMA_VERSION:
        raise ValueError(
            f"{file}: schema_version is {version}, this program reads {SCHEMA_VERSION}; use the "
            "program's version that wrote it, or move the run out of the folder"
        )
    try:
        history = pd.read_csv(folder / "metrics.csv")
        if missing := {"step", "run_seconds"} - set(history.columns):
            raise KeyError(*missing)
    except (OSError, ValueError, KeyError) as error:
        raise _SkippedRunError(f"metrics.csv cannot be read ({_describe(error)})") from error
    run = Run(folder, result, history)
    try:
        _check_complete(run)
    except (KeyError, TypeError) as error:
        raise _SkippedRunError(f"result.json is incomplete ({_describe(error)})") from error
    return run


def _describe(error: Exception) -> str:
    return f"no {error}" if isinstance(error, KeyError) else str(error)


def _check_complete(run: Run) -> None:
    """Touches everything that is read later, so that what lacks is known before any output."""
    result = run.result
    for key in ("seed", "scene_hash", "reference_hash", "run_seconds", "steps"):
        _ = result[key]
    for key in ("patches_traced", "paths_traced", "frames"):
        _ = result[key]
    _ = result["protocol"]["name"], result["protocol"]["identity"]
    for key in ("scene", "sampler", *DISTINCTIONS):
        _ = run.label[key]
    for set_name in SETS:
        for metric in METRICS:
            for statistic in ("mean", "worst5", "floor"):
                run.metric(set_name, metric, statistic)


def check_comparable(runs: Sequence[Run]) -> None:
    """Raises ValueError, naming two runs and their values, where a table would mix what differs.

    All runs need one protocol; all runs of a scene the same scene files and reference images; no
    method may occur twice with the same seed.
    """

    def protocol(run: Run) -> str:
        named = run.result["protocol"]
        return f"{named['name']} ({named['identity']})"

    _require_equal(runs, "protocols", protocol)
    for scene in sorted({run.scene for run in runs}):
        of_scene = [run for run in runs if run.scene == scene]
        _require_equal(of_scene, "versions of the scene", lambda run: run.result["scene_hash"])
        _require_equal(of_scene, "reference images", lambda run: run.result["reference_hash"])
    seen: dict[tuple[str, str, int], Run] = {}
    for run in runs:
        other = seen.setdefault((run.scene, run.method, run.seed), run)
        if other is not run:
            raise ValueError(
                f"{other.folder} and {run.folder} are the same method ({run.method}) with the "
                f"same seed ({run.seed}); move one of them out of the folder"
            )


def comparison_warnings(runs: Sequence[Run]) -> list[str]:
    """What makes a comparison doubtful without forbidding it, a line each.

    Trained runs of one scene whose run times are more than 5 % apart, runs of which some counted
    measured costs instead of the wall clock's seconds, and runs of different machines.
    """
    warnings = []
    for scene in sorted({run.scene for run in runs}):
        trained = [run for run in runs if run.scene == scene and run.result["steps"]]
        if not trained:
            continue
        times = {run.folder: run.result["run_seconds"] for run in trained}
        shortest, longest = min(times, key=times.__getitem__), max(times, key=times.__getitem__)
        if times[longest] > (1 + MOST_TIME_APART) * times[shortest]:
            warnings.append(
                f"{scene}: the runs were not given the same time: {times[shortest]:.0f} s in "
                f"{shortest}, {times[longest]:.0f} s in {longest}"
            )
    for what, value in (
        ("were timed by different clocks", _clock),
        ("come from different machines", _machine),
    ):
        first: dict[str, Path] = {}
        for run in runs:
            first.setdefault(value(run), run.folder)
        if len(first) > 1:
            found = "; ".join(f"{name} in {folder}" for name, folder in first.items())
            warnings.append(f"the runs {what}: {found}")
    return warnings


def _clock(run: Run) -> str:
    """'wall', or 'model' where run time was counted with measured costs per step."""
    return run.result.get("clock", "wall")


def _machine(run: Run) -> str:
    machine = run.result.get("machine", {})
    return f"{machine.get('processor')}, {machine.get('backend')}"


def _require_equal(runs: Sequence[Run], what: str, value: Callable[[Run], str]) -> None:
    first = runs[0]
    for run in runs[1:]:
        if value(run) != value(first):
            raise ValueError(
                f"runs of two {what} cannot be compared: {first.folder} has {value(first)}, "
                f"{run.folder} has {value(run)}; report them from separate folders"
            )
