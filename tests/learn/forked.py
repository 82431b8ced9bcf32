"""Whole runs in processes that start in no time, forked from one that has imported everything.

They can be killed, stopped and starved as any other; a command line takes seconds to start.
"""

import copy
import logging
from collections.abc import Callable
from functools import cache
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig, OmegaConf

from ngi.train import train
from tests import warm
from tests.learn.command_line import SIZE
from tests.learn.composition import run_config


@cache
def _composed(*overrides: str) -> DictConfig:
    config = run_config(
        *SIZE,
        "budget=steps",
        "budget.steps=40",
        "run.checkpoint_steps=7",
        "evaluation.count=3",
        "run.references=references",
        *overrides,
    )
    return OmegaConf.create(OmegaConf.to_container(config, resolve=True))


def configuration(folder: Path, *overrides: str, references: Path | None = None) -> DictConfig:
    """Of a run of 40 steps that writes into `folder`/run and is evaluated thrice.

    references: folder of the references, by default `folder`/references
    """
    config = copy.deepcopy(_composed(*overrides))
    config.run.folder = str(folder / "run")
    config.evaluation.evaluator.cache.folder = str(references or folder / "references")
    return config


def start(
    config: DictConfig, output: Path, *, first: Callable[[], Any] | None = None
) -> ForkServerProcess:
    """Starts training in a process whose exit status and `output` are those of a command line.

    first: called in that process before it trains
    """
    process = warm.process(_work, config, output, first)
    process.start()
    return process


def run(
    config: DictConfig, output: Path, *, first: Callable[[], Any] | None = None
) -> tuple[int, str]:
    """Exit status, and everything printed by this and earlier runs with the same `output`."""
    return warm.finish(start(config, output, first=first), output, seconds=120)


def _work(config: DictConfig, output: Path, first: Callable[[], Any] | None) -> None:
    warm.begin(output)
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    torch.set_num_threads(1)
    warm.without_semaphores()
    if first is not None:
        first()
    train(config)
