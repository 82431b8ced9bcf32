"""Finds the runs below a folder, reads them, and refuses to compare what cannot be compared."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.records import read_records
from analysis.run_checks import (
    DISTINCTIONS,
    METRICS,
    SETS,
    check_logs,
    check_result,
    read_table,
)

__all__ = ["DISTINCTIONS", "FURTHER", "METRICS", "SETS", "Run", "check_comparable", "find_runs"]

SCHEMA_VERSION = 1
"""Of the result files this program understands."""

FURTHER = ("relmse", "tail")
"""Measured beside the paper's metrics, of a set's frames together; older runs lack them."""


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
        label: dict[str, str] = self.result["label"]
        return label

    @property
    def seed(self) -> int:
        seed: int = self.result["seed"]
        return seed

    @property
    def clock(self) -> str:
        """'wall', or 'model' where run time was counted with measured costs per step."""
        clock: str = self.result.get("clock", "wall")
        return clock

    @property
    def versions(self) -> list[dict[str, Any]]:
        """Of the program, in order: 'commit', 'dirty' and perhaps 'code', a hash over its modules.

        Several where the run was interrupted and the program changed before it went on.
        """
        last = {key: self.result.get(key) for key in ("commit", "dirty")}
        return self.result.get("commits") or [last]

    def diverged(self, set_name: str) -> bool:
        """Whether its last errors on a set are not finite: MAPE, which all have, tells."""
        errors = self.history.get(f"{set_name}_mape")
        return errors is not None and not math.isfinite(float(errors.iloc[-1]))

    @property
    def diverged_anywhere(self) -> bool:
        """Whether it has on any of the `SETS`."""
        return any(map(self.diverged, SETS))

    def metric(self, set_name: str, metric: str, statistic: str = "mean") -> float | None:
        """One metric at the end of the run; statistic is mean, worst5 or floor; None if missing.

        Of `FURTHER` there is the mean alone: they have no floor.
        """
        if metric in FURTHER:
            found: float | None = self.result.get(metric, {}).get(set_name)
            return found if statistic == "mean" else None
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
        raise _SkippedRunError("unfinished: there is no result.json yet")
    try:
        result = json.loads(file.read_text())
        if not isinstance(result, dict):
            raise TypeError("it is not a JSON object")
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
        check_result(result)
    except (KeyError, TypeError, AttributeError) as error:
        raise _SkippedRunError(f"result.json is incomplete ({_describe(error)})") from error
    try:
        check_logs(folder, result)
        history = read_table(folder / "metrics.csv")
        if (folder / "steps.csv").exists():
            read_table(folder / "steps.csv")
        elif (folder / "chains.bin").exists():
            raise ValueError("there is a chains.bin but no steps.csv; restore it from a copy")
        for name in ("chains.bin", "target_map.bin"):
            read_records(folder / name)
    except ValueError as error:
        raise _SkippedRunError(str(error)) from error
    return Run(folder, result, history)


def _describe(error: Exception) -> str:
    return f"no {error}" if isinstance(error, KeyError) else str(error)


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


def _require_equal(runs: Sequence[Run], what: str, value: Callable[[Run], str]) -> None:
    first = runs[0]
    for run in runs[1:]:
        if value(run) != value(first):
            raise ValueError(
                f"runs with different {what} cannot be compared: {first.folder} has "
                f"{value(first)}, {run.folder} has {value(run)}; report them from separate folders"
            )
