"""How long training waits for patches, rendered in turn with it and by a process beside it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tqdm import tqdm

from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.scenes import Scene

STEPS = 150
"""Of which only the first two have to be on new patches."""
ROUNDS = 2


def waiting(scene: Scene) -> list[Figure]:
    """The same short run with 0 workers and with 1, twice each in turn.

    Raises RuntimeError, with what it said, for a run that fails.
    """
    rounds = [
        (result_of_run(scene.overrides, workers=0), result_of_run(scene.overrides, workers=1))
        for _ in tqdm(range(ROUNDS), desc=f"waiting, {scene.name}", leave=False)
    ]
    in_turn, ahead = zip(*rounds, strict=True)
    return waiting_figures(in_turn, ahead)


def waiting_figures(
    in_turn: Sequence[dict[str, Any]], ahead: Sequence[dict[str, Any]]
) -> list[Figure]:
    """Of the results of runs that were made in turn."""
    waits, rates = (
        [[value(result) for result in results] for results in (in_turn, ahead)]
        for value in (_share_of_waiting, _steps_per_second)
    )
    return [
        figure("waiting for patches, in turn", waits[0], "%"),
        figure("waiting for patches, one worker ahead", waits[1], "%"),
        figure("in turn", rates[0], "steps/s"),
        figure("one worker ahead", rates[1], "steps/s"),
        figure("one worker ahead / in turn", ratio(rates[1], rates[0]), "×", "≥ 1"),
    ]


def result_of_run(scene: Sequence[str], *, workers: int) -> dict[str, Any]:
    """The result of a short run in a fresh process, which says what its seconds went to."""
    with TemporaryDirectory() as folder:
        command = [
            *(sys.executable, "-m", "ngi.train", "budget=small", "evaluation=smoke"),
            *(f"budget.steps={STEPS}", "budget.seconds=null", "evaluation.count=1"),
            "reuse.policy.bootstrap_batches=2",
            *(f"renderer.workers={workers}", f"run.folder={folder}", *scene),
        ]
        child = subprocess.run(command, capture_output=True, text=True, check=False)
        if child.returncode != 0:
            said = child.stdout + child.stderr
            raise RuntimeError(f"{' '.join(command[1:])} failed:\n{said}")
        result: dict[str, Any] = json.loads((Path(folder) / "result.json").read_text())
    return result


def _share_of_waiting(result: dict[str, Any]) -> float:
    share: float = 100 * result["seconds"]["render"] / result["run_seconds"]
    return share


def _steps_per_second(result: dict[str, Any]) -> float:
    rate: float = result["steps"] / result["run_seconds"]
    return rate
