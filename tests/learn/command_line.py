"""Runs the program as a user does, on the analytic renderer and at a size that takes seconds."""

import os
import subprocess
import sys
import tempfile
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import ngi
from tests import warm

CHECKOUT = Path(ngi.__file__).parents[1]
"""Of the program that the other tests import, wherever another one is installed."""

SIZE = (
    "renderer=analytic",
    "renderer.patch_size=16",
    "resolution=constant",
    "resolution.start=32",
    "sampler.chains=4",
    "model.hidden_features=16",
    "model.hidden_layers=2",
    "reuse.policy.bootstrap_batches=5",
    "reuse.policy.beta=1.0",
    "optimizer.lr=1e-3",
    "evaluation=smoke",
    "run.linear_megabytes=0",  # closed formulas do without Mitsuba, which is slow to import
)
SMALL = (*SIZE, "budget=steps", "budget.steps=12")
BRIEF = (*SIZE, "budget=seconds", "budget.seconds=2")


def environment(folder: Path) -> dict[str, str]:
    return {
        **os.environ,
        "NGI_CACHE": str(folder / "cache"),
        "OMP_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join([str(folder), str(CHECKOUT)]),
    }


def start(
    folder: Path,
    *overrides: str,
    output: Path,
    options: tuple[str, ...] = (),
    base: tuple[str, ...] = SMALL,
) -> ForkServerProcess:
    """A process that need not import everything first, and prints into `output`.

    options: of Hydra, such as --multirun. base: overrides that come before `overrides`.
    """
    return warm.start_module(
        "ngi.train",
        *(*options, *base, *overrides),
        folder=folder,
        environment=environment(folder),
        output=output,
    )


def run(
    folder: Path, *overrides: str, options: tuple[str, ...] = (), base: tuple[str, ...] = SMALL
) -> tuple[int, str]:
    """The same, until it has ended: exit status and everything printed."""
    return run_module("ngi.train", *options, *base, *overrides, folder=folder)


def run_cold(folder: Path, *overrides: str, options: tuple[str, ...] = ()) -> tuple[int, str]:
    """The same by a process of its own, as launchers need it, whose processes have it as parent."""
    ended = subprocess.run(
        [sys.executable, "-m", "ngi.train", *options, *SMALL, *overrides],
        cwd=folder,
        env=environment(folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        check=False,
    )
    return ended.returncode, ended.stdout


def run_module(module: str, *words: str, folder: Path) -> tuple[int, str]:
    """`python -m MODULE WORDS` in `folder`: exit status and everything printed."""
    with tempfile.TemporaryDirectory() as elsewhere:
        output = Path(elsewhere) / "output"
        started = warm.start_module(
            module, *words, folder=folder, environment=environment(folder), output=output
        )
        return warm.finish(started, output, seconds=300)
