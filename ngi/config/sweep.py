"""A sweep from its start to its end: a table of its runs, a line after each, what is amiss.

Hydra calls this (`hydra.callbacks`) in the process that starts the sweep. Processes that its
launcher starts have a copy.
"""

import atexit
import json
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, NoReturn

from hydra.core.global_hydra import GlobalHydra
from hydra.core.utils import JobReturn, JobStatus
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ngi.config.hydra_program import explained, in_plain_words
from ngi.config.sweep_plan import (
    Planned,
    counted,
    duration,
    planned_run,
    planned_runs,
    shown,
    table,
)
from ngi.config.unread_output import readers_may_leave
from ngi.files.durable import write_atomically

NOT_COMPOSED = (HydraException, OmegaConfBaseException)
"""What is raised where the configuration of a job cannot be put together."""


class Sweep(Callback):
    """dry_run: whether the table is all that is wanted; ends the program with status 0 then, or
    with 1 where a run cannot start.
    """

    def __init__(self, *, dry_run: bool) -> None:
        self._dry_run = dry_run
        self._runs: list[Planned] = []
        self._notes: Path | None = None  # a file per run that has ended, for all processes to see
        self._begun = 0.0

    def on_run_start(self, config: DictConfig, **_: Any) -> None:
        if self._dry_run:
            _show_and_exit(lambda: [planned_run(config, {})])

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        if self._dry_run:
            _show_and_exit(lambda: _planned(config))
        self._begun = time.time()
        folder = Path(config.hydra.sweep.dir).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        self._notes = Path(mkdtemp(prefix=".sweep-", dir=folder))
        atexit.register(self._end)
        with suppress(*NOT_COMPOSED):  # Hydra will say what is wrong
            self._runs = _planned(config)
        if self._runs:
            print(table(self._runs), flush=True)

    def on_job_end(self, config: DictConfig, job_return: JobReturn, **_: Any) -> None:
        if self._notes is None or not self._notes.is_dir():
            return  # a run alone
        folder = Path(config.run.folder).resolve()
        note = {"folder": str(folder), "failure": _failure(job_return)}
        # another job of the sweep may read it meanwhile
        write_atomically(self._notes / f"{config.hydra.job.num}.json", json.dumps(note).encode())
        if self._runs:
            ended = self._ended()
            failed = sum(note["failure"] is not None for note in ended.values())
            elapsed = time.time() - self._begun
            print(progress(self._runs, [*ended], failed, elapsed), file=sys.stderr, flush=True)

    def _ended(self) -> dict[int, dict[str, Any]]:
        """Notes of runs that have ended, in whatever process, by their number."""
        assert self._notes is not None
        files = sorted(self._notes.glob("*.json"), key=lambda file: int(file.stem))
        return {int(file.stem): json.loads(file.read_text()) for file in files}

    def _end(self) -> None:
        """Says at the end of the program which runs failed, and why, and which have not ended."""
        assert self._notes is not None
        ended = [*self._ended().values()]
        shutil.rmtree(self._notes, ignore_errors=True)
        failures = [note for note in ended if note["failure"] is not None]
        if failures:
            lines = [f"  {shown(Path(note['folder']))}: {note['failure']}" for note in failures]
            text = "\n".join([f"{counted(failures)} of this sweep failed:", *lines])
            print(text, file=sys.stderr, flush=True)
        over = {Path(note["folder"]) for note in ended}
        left = [run for run in self._runs if run.folder not in over and run.state != "finished"]
        if left:
            has = "has" if len(left) == 1 else "have"
            folders = ", ".join(shown(run.folder) for run in left)
            text = (
                f"{counted(left)} of this sweep {has} not ended (killed, not started, or still "
                f"waiting or running on a cluster): {folders}; the same command goes on"
            )
            print(text, file=sys.stderr, flush=True)


def progress(runs: Sequence[Planned], ended: Sequence[int], failed: int, elapsed: float) -> str:
    """One line over all runs.

    ended: numbers of the runs that are over; failed: how many of them failed; elapsed: seconds
    What is left goes by the training that was left of each run when the sweep began.
    """
    known = [run.left for run in runs if run.runs and run.left]
    typical = sum(known) / len(known) if known else 1.0
    weights = [(run.left or typical) if run.runs else 0.0 for run in runs]
    share = sum(weights[number] for number in ended) / (sum(weights) or 1.0)
    parts = [f"sweep: {len(ended)} of {len(runs)} runs done"]
    parts += [f"{failed} failed"] if failed else []
    parts += [f"{duration(elapsed)} so far"]
    parts += [f"about {duration(elapsed * (1 - share) / share)} left"] if 0 < share < 1 else []
    return ", ".join(parts)


def _failure(job: JobReturn) -> str | None:
    """Why a run failed, in one line; None where it did not."""
    if job.status != JobStatus.FAILED:
        return None
    error = job._return_value  # `return_value` would raise it
    cause = error.__cause__ or error
    said = in_plain_words(cause) if isinstance(cause, Exception) else str(cause)
    return (said.splitlines() or [type(cause).__name__])[0]


def _planned(config: DictConfig) -> list[Planned]:
    """None of a sweeper that chooses its runs as it goes."""
    return planned_runs(config, GlobalHydra.instance().config_loader())


def _show_and_exit(plan: Callable[[], Sequence[Planned]]) -> NoReturn:
    """Does not return whatever happens: Hydra answers an exception with a warning, and trains."""
    try:
        runs = plan()
        if not runs:
            sys.exit("--dry-run: this sweeper chooses each run as it goes; there is no plan")
        with readers_may_leave():
            print(table(runs))
    except NOT_COMPOSED as error:
        sys.exit(explained(error))
    except Exception:
        traceback.print_exc()
        sys.exit("--dry-run: this is a bug; nothing was trained")
    sys.exit(int(any(run.state.startswith("cannot") for run in runs)))
