"""Runs of the program in processes of their own, which are ended when the time is up."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import Any

import torch

from ngi.files.run_folder import LAST
from ngi.learn import read_checkpoint
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.gpu_check.item import CutOffError, Outcome

FORMULAS = (
    *("renderer=analytic", "evaluation=smoke", "evaluation.count=1", "resolution=constant"),
    *("budget=steps", "budget.steps=60", "run.linear_megabytes=0"),
)
"""Of short runs, all of which are on closed formulas, so that both devices see the same patches."""
METHODS = {
    "active_exploration": (
        "renderer.patch_size=16",
        "resolution.start=32",
        "model=pixel_generator",
    ),
    "ours": (
        *("renderer.patch_size=16", "resolution.start=32"),
        *("schedule.warmup_steps=5", "~renderer.direct", "~renderer.specular"),  # not of formulas
        "data=patches_without_camera",  # Open Image Denoise is not on every machine
    ),
    "cnsr": ("renderer.patch_size=16", "resolution.start=16", "sampler.chains=4"),
    "anf": (
        *("renderer.patch_size=16", "resolution.start=32", "sampler.chains=2"),
        *("data.frames=2", "model.dilations=[1,2]", "reuse.store.capacity=8"),
    ),
}
TIME_TO_END = 120.0
"""Seconds for a run to write its checkpoint after it was asked to end."""


def run(folder: Path, overrides: Sequence[str], *, seconds: float) -> dict[str, Any]:
    """The result of the run in this folder, begun or gone on with.

    Raises CutOffError where it takes more seconds, RuntimeError with what it said where it fails.
    """
    command = [sys.executable, "-m", "ngi.train", *overrides, f"run.folder={folder}"]
    folder.parent.mkdir(parents=True, exist_ok=True)
    log = folder.with_suffix(".log")
    with log.open("a") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            status = process.wait(timeout=max(1.0, seconds))
        except subprocess.TimeoutExpired as error:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(timeout=TIME_TO_END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            raise CutOffError(f"{folder} goes on next time") from error
    if status != 0:
        raise RuntimeError(f"{' '.join(command[1:])} failed:\n{log.read_text()[-2000:]}")
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return result


def learning(method: str, folder: Path, seconds: float) -> Outcome:
    """A method's short run on the processor, and where there is a GPU three times there.

    The third time as CUDA graphs. seconds: for all of them
    """
    end = monotonic() + seconds
    overrides = (
        *(*FORMULAS, f"method={method}", *METHODS[method]),
        *("model.hidden_features=32", "model.hidden_layers=2"),
        f"run.references={folder / 'references'}",
    )
    ways = {
        "cpu": ("trainer.accelerator=cpu",),
        "gpu": (),
        "again": (),
        "graphs": ("trainer=graphs", "trainer.precision=32-true"),
    }
    errors, weights = {}, {}
    for name, way in ways.items():
        place = folder / method / name
        result = run(place, (*overrides, *way), seconds=end - monotonic())
        errors[name] = result["metrics"]["hard"]["mape"]["mean"]
        weights[name] = read_checkpoint(place / LAST)["state_dict"]
    apart = 100 * abs(errors["gpu"] / errors["cpu"] - 1)
    again, graphs = (
        all(torch.equal(w, weights[other][n]) for n, w in weights["gpu"].items())
        for other in ("again", "graphs")
    )
    return Outcome(
        [
            figure(f"{method}: error on the GPU against the processor's", [apart], "%", "≤ 5"),
            figure(f"{method}: a run repeats bit for bit", [float(again)], "", "1"),
            figure(f"{method}: the same bits as CUDA graphs", [float(graphs)], "", "1"),
        ]
    )


def training(folder: Path, overrides: Sequence[str], seconds: float) -> Outcome:
    """A run at the paper's size; goes on where it was cut off."""
    options = (*overrides, "run.checkpoint_seconds=30", "run.linear_megabytes=0")
    result = run(folder, options, seconds=seconds)
    figures = training_figures(result)
    return Outcome([replace(f, scene=f"{folder.parent.name}, {folder.name}") for f in figures])


def training_figures(result: dict[str, Any]) -> list[Figure]:
    """Of a run's result."""
    taken, metrics = result["run_seconds"], result["metrics"]["hard"]
    return [
        figure("run time", [taken], "s"),
        figure("steps", [result["steps"]], ""),
        figure("speed", [result["steps"] / taken], "steps/s"),
        figure("paths", [result["paths_traced"] / taken / 1e6], "million/s"),
        *(
            figure(f"share of {phase}", [100 * spent / taken], "%")
            for phase, spent in result["seconds"].items()
            if spent > 0 and phase not in ("evaluate", "checkpoint")
        ),
        figure("MAPE", [metrics["mape"]["mean"]], ""),
        figure("DSSIM", [metrics["dssim"]["mean"]], ""),
    ]
