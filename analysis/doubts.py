"""What makes a comparison of runs doubtful without forbidding it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.runs import Run

MOST_TIME_APART = 0.05
"""Relative difference of run times up to which runs count as given the same time."""

MOST_KEYS = 3
"""Of the settings that differ, that are named."""


def _shown(seconds: float) -> str:
    return f"{seconds:.{0 if seconds >= 100 else 1}f} s"


def comparison_warnings(runs: Sequence[Run]) -> list[str]:
    """What makes a comparison doubtful without forbidding it, a line each.

    Runs that ended with errors that are not finite, trained runs of one scene whose run times are
    more than 5 % apart, runs of which some counted measured costs instead of the wall clock's
    seconds, runs of different commits, of changed files, of different machines, and of one method
    and scene with different settings.
    """
    warnings = _of_different_settings(runs)
    if diverged := [str(run.folder) for run in runs if run.diverged_anywhere]:
        warnings.append(
            f"{len(diverged)} run(s) ended with errors that are not finite, and so do means over "
            f"their seeds; curves and times to equal error leave them out: {', '.join(diverged)}"
        )
    for scene in sorted({run.scene for run in runs}):
        trained = [run for run in runs if run.scene == scene and run.result["steps"]]
        if not trained:
            continue
        times = {run.folder: run.result["run_seconds"] for run in trained}
        shortest, longest = min(times, key=times.__getitem__), max(times, key=times.__getitem__)
        if times[longest] > (1 + MOST_TIME_APART) * times[shortest]:
            warnings.append(
                f"{scene}: the runs had different run times: {_shown(times[shortest])} in "
                f"{shortest}, {_shown(times[longest])} in {longest}"
            )
    if changed := [r.folder for r in runs if any(v.get("dirty") for v in r.versions)]:
        warnings.append(
            f"{len(changed)} run(s) were made with uncommitted changes, for example {changed[0]}"
        )
    for what, value in (
        ("were made with different commits", _commits),
        ("were timed by different clocks", lambda run: run.clock),
        ("come from different machines", partial(_machine, parts=_machine_parts(runs))),
    ):
        first: dict[str, Path] = {}
        for run in runs:
            first.setdefault(value(run), run.folder)
        if len(first) > 1:
            found = "; ".join(f"{name} in {folder}" for name, folder in first.items())
            warnings.append(f"the runs {what}: {found}")
            if value is _commits and _one_program(runs):
                warnings[-1] += "; the program itself is the same"
    return warnings


def _of_different_settings(runs: Sequence[Run]) -> list[str]:
    """A line for every scene and method whose runs differ by more than their seeds.

    As they do where what was chosen depends on the machine, the network of `budget=machine` for
    example: their scatter is no scatter between seeds.
    """
    warnings = []
    by_method: dict[tuple[str, str], list[Run]] = {}
    for run in runs:
        by_method.setdefault((run.scene, run.method), []).append(run)
    for (scene, method), alike in sorted(by_method.items()):
        settings = [_settings(run.result["config"]) for run in alike]
        for run, own in zip(alike[1:], settings[1:], strict=True):
            keys = sorted(settings[0].keys() | own.keys())
            if apart := [key for key in keys if settings[0].get(key) != own.get(key)]:
                shown = ", ".join(
                    f"{key} ({settings[0].get(key)} and {own.get(key)})"
                    for key in apart[:MOST_KEYS]
                )
                more = f" and {len(apart) - MOST_KEYS} more" if len(apart) > MOST_KEYS else ""
                warnings.append(
                    f"{scene}: runs of {method} differ in {shown}{more}: {alike[0].folder} and "
                    f"{run.folder}"
                )
                break
    return warnings


def _settings(config: dict[str, Any]) -> dict[str, Any]:
    """By key, what decides a run's result, but for seeds and the measured costs of its steps."""
    found = pd.json_normalize({key: part for key, part in config.items() if key != "costs"})
    settings = {str(key): value for key, value in found.iloc[0].items()}
    return {key: value for key, value in settings.items() if key.split(".")[-1] != "seed"}


def _commits(run: Run) -> str:
    """Of all versions of the program that the run was made with, in order; changed ones by hash."""
    return " then ".join(dict.fromkeys(map(_named, run.versions)))


def _named(version: dict[str, Any]) -> str:
    commit = str(version["commit"])[:12]
    if not version.get("dirty"):
        return commit
    return f"{commit} and changes ({version['code'][:8]})" if "code" in version else commit


def _one_program(runs: Sequence[Run]) -> bool:
    """Whether all runs are known to be made with the same modules, whatever the commit."""
    codes = {version.get("code") for run in runs for version in run.versions}
    return len(codes) == 1 and None not in codes


def _machine_parts(runs: Sequence[Run]) -> list[str]:
    """By what machines are told apart: what all runs have kept of theirs."""
    machines = [run.result.get("machine", {}) for run in runs]
    added = [part for part in ("cores", "gpu") if all(part in machine for machine in machines)]
    return ["processor", "backend", *added]


def _machine(run: Run, *, parts: Sequence[str]) -> str:
    machine = run.result.get("machine", {})
    shown = {**machine, "cores": f"{machine.get('cores')} cores"}
    return ", ".join(str(shown.get(part)) for part in parts if part != "gpu" or shown["gpu"])
