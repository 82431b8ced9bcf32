"""All runs of a plan: in processes, resumable, into one folder."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import torch
from tqdm import tqdm

from ngi.files.durable import write_atomically
from ngi.machine.child_process import end_with_parent
from ngi.machine.memory import keep_freed_memory
from ngi.render import PocketRenderer
from ngi.studies.exploration_map.plan import BASE, Plan
from ngi.studies.exploration_map.setting import Method, Setting
from ngi.studies.exploration_map.training import plain_configuration, train
from ngi.studies.provenance import claim

TABLE = "exploration_map.csv"


class Run(NamedTuple):
    setting: Setting
    method: Method
    seed: int

    def file(self, folder: Path) -> Path:
        """Where its rows are, once it is finished."""
        return folder / "runs" / self.setting.name / f"{self.method.name}-seed={self.seed}.csv"


def run_all(plan: Plan, *, seeds: Sequence[int], folder: Path, jobs: int) -> Path:
    """Does the runs that `folder` does not hold yet, and writes the table of all of them.

    The first seed of every setting comes first, so that an interrupted map is a whole one of fewer
    seeds. Returns the table's path: a row per evaluation, the columns of `training.train`.
    Raises ValueError for a folder with runs of another size or configuration.
    """
    _claim(folder, plan)
    runs = [
        Run(setting, method, seed)
        for seed in seeds
        for setting in plan.settings
        for method in plan.methods
    ]
    _do([run for run in runs if not run.file(folder).exists()], plan, folder, jobs, len(runs))
    table = pd.concat([pd.read_csv(run.file(folder)) for run in runs], ignore_index=True)
    write_atomically(folder / TABLE, table.to_csv(index=False).encode())
    return folder / TABLE


def _do(runs: Sequence[Run], plan: Plan, folder: Path, jobs: int, total: int) -> None:
    work = partial(_run_to_file, plan=plan, folder=folder)
    context = multiprocessing.get_context("spawn")  # forked PyTorch may hang
    with (
        ProcessPoolExecutor(jobs, mp_context=context, initializer=_prepare_process) as pool,
        tqdm(total=total, initial=total - len(runs), unit="run", mininterval=5) as bar,
    ):
        futures = [pool.submit(work, run) for run in runs]
        try:
            _wait(futures, bar)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _wait(futures: Iterable[Future[None]], bar: tqdm[Any]) -> None:
    for future in as_completed(futures):
        future.result()
        bar.update()


def _prepare_process() -> None:
    torch.set_num_threads(1)  # the networks are small, and the other cores have their own runs
    keep_freed_memory()
    end_with_parent()


def _run_to_file(run: Run, *, plan: Plan, folder: Path) -> None:
    file = run.file(folder)
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        table = pd.DataFrame(train(*run, plan, folder=file.parent))
    except FloatingPointError as error:
        raise ValueError(f"{file.relative_to(folder)} cannot be made: {error}") from error
    write_atomically(file, table.to_csv(index=False).encode())


def _claim(folder: Path, plan: Plan) -> None:
    """See `ngi.studies.provenance.claim`."""
    made_with = {
        "size": {"steps": plan.steps, "evaluations": plan.evaluations, "frames": plan.frames},
        "scene": PocketRenderer(**BASE.scene, patch_size=1).scene_hash,
        "configuration": {m.name: plain_configuration(m, plan) for m in plan.methods},
    }
    claim(folder, made_with, backend=PocketRenderer.description, option="--output")
