"""What trackers by other programs have in common: they are called aside, and named alike."""

import json
import logging
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from queue import Full, Queue
from threading import Event, Thread
from time import monotonic
from typing import Any

from ngi.evaluate import SETS, Comparison, Evaluation
from ngi.files.durable import write_atomically
from ngi.files.row_log import RowLog
from ngi.files.run_folder import TRACKED
from ngi.files.run_names import run_group, shortened
from ngi.learn.interruption import Interrupted
from ngi.learn.tracker import Row, Tracker

_logger = logging.getLogger(__name__)

CAPACITY = 10_000
"""Calls that wait at most; a run whose calls take longer than its steps drops the rest."""


class Aside:
    """Makes calls one after the other, in a thread that ends with the program.

    name: of what is called, for the log. consequence: what it means when calls fail.

    The first call that raises is the last one: it is logged, and nothing more is called.
    """

    def __init__(self, name: str, *, consequence: str) -> None:
        self._name = name
        self._consequence = consequence
        self._calls: Queue[Callable[[], None] | None] = Queue(maxsize=CAPACITY)
        self._ended = Event()
        self._failed = False
        self.dropped = 0
        """How many calls were never made, since too many waited."""
        Thread(target=self._serve, name=f"aside-{name}", daemon=True).start()

    def call(self, function: Callable[[], None]) -> None:
        """Never waits and never raises; too many calls that wait are dropped."""
        try:
            self._calls.put_nowait(function)
        except Full:
            if self.dropped == 0:
                self._warn(f"takes no more calls: {CAPACITY} are waiting already")
            self.dropped += 1

    def end(self, *last: Callable[[], None], seconds: float) -> None:
        """Makes the last calls and waits for all, for so long at most; says what was lost."""
        deadline = monotonic() + seconds
        try:
            for call in (*last, None):
                self._calls.put(call, timeout=max(0.0, deadline - monotonic()))
        except Full:
            pass  # nothing moves any more
        else:
            self._ended.wait(max(0.0, deadline - monotonic()))
        if not self._ended.is_set():
            self._warn(f"has not finished after {seconds:g} s; the run ends without it")
        if self.dropped:
            self._warn(f"has lost {self.dropped} calls")

    def _serve(self) -> None:
        while (call := self._calls.get()) is not None:
            if self._failed:
                continue
            try:
                call()
            except BaseException as error:  # SystemExit too: the thread has to go on taking calls
                self._failed = True
                self._warn(f"failed ({type(error).__name__}: {error})")
        self._ended.set()

    def _warn(self, problem: str) -> None:
        _logger.warning("%s %s; %s", self._name, problem, self._consequence)


FINISH_SECONDS = 60.0
"""How long a program may take to send what is left at the end of a run."""

LEEWAY_SECONDS = 10.0
"""How much longer it may take to say so."""


class Remote(Tracker):
    """A tracker by another program, which may fail or hang.

    Nothing waits for it but the end of the run, and that not for long. Where it fails, a warning
    says so once and the run goes on with its own files.

    every: of how many steps one is passed on; steps.csv has all of them
    Raises ValueError where that is no positive number.

    What it is told goes by the names that these programs put into sections: 'step' and
    'run_seconds', the two axes; 'train/…' of a step; 'hard/mape', 'uniform/dssim_worst5', … of an
    evaluation, 'best/hard_mape', … the lowest so far, and 'run/…' for what else it counts.
    """

    name: str
    """Of the program."""

    def __init__(self, *, every: int = 1) -> None:
        if every < 1:
            raise ValueError(f"tracker.every: {every}; expected at least 1 step")
        self._every = every
        self._aside: Aside | None = None
        self._folder = Path()
        self._best: dict[str, float] = {}

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        self._import()
        self._folder = folder
        self._best = {}
        for row in RowLog(folder / "metrics.csv").rows():
            self._better(row)
        self._aside = Aside(
            self.name,
            consequence=f"it lacks some rows; all of them are in the files of {folder}",
        )
        self._call(lambda: self._begin(folder, settings, label))

    def step(self, row: Row) -> None:
        if int(str(row["step"])) % self._every == 0:
            named = _named(row, lambda key: f"train/{key}")
            self._call(lambda: self._log(named))

    def evaluated(self, row: Row, evaluation: Evaluation) -> None:
        self._tell(row)
        step, comparison = int(str(row["step"])), evaluation.comparison(SETS[0])
        self._call(lambda: self._show(comparison, step))

    def finish(self, failure: BaseException | None) -> None:
        if self._aside is None:
            return
        last = [self._keep] if failure is None else []
        last.append(lambda: self._end(failure))
        self._aside.end(*last, seconds=FINISH_SECONDS + LEEWAY_SECONDS)
        self._aside = None

    def _call(self, function: Callable[[], None]) -> None:
        if self._aside is not None:
            self._aside.call(function)

    def _tell(self, row: Row) -> None:
        """A row of metrics.csv."""
        named = {**_named(row, _section), **self._better(row)}
        self._call(lambda: self._log(named))

    def _better(self, row: Row) -> dict[str, float]:
        """The lowest of every metric by now, this row's included."""
        for key, value in _metrics(row).items():
            self._best[key] = min(value, self._best.get(key, value))
        return {f"best/{key}": value for key, value in self._best.items()}

    @abstractmethod
    def _import(self) -> None:
        """RuntimeError, with what to do, where the program is not installed."""

    # What follows is called aside, in this order; whatever it raises is a warning.

    @abstractmethod
    def _begin(self, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None: ...

    @abstractmethod
    def _log(self, row: dict[str, float]) -> None:
        """A row by its names there, without what is empty."""

    @abstractmethod
    def _show(self, comparison: Comparison, step: int) -> None:
        """The pictures of an evaluation."""

    @abstractmethod
    def _keep(self) -> None:
        """Files of the finished run."""

    @abstractmethod
    def _end(self, failure: BaseException | None) -> None: ...


def reason(failure: BaseException | None) -> str:
    """'interrupted by SIGTERM' or 'ValueError: …', 500 characters at most; empty for no failure."""
    if isinstance(failure, Interrupted):
        return f"interrupted by {failure.number.name}"
    return "" if failure is None else f"{type(failure).__name__}: {failure}"[:500]


def kept_id(folder: Path, tracker: str, make: Callable[[], str]) -> str:
    """By which a tracker knows the run in this folder, across interruptions; made where missing."""
    file = folder / TRACKED
    ids: dict[str, str] = json.loads(file.read_text()) if file.exists() else {}
    if tracker not in ids:
        ids[tracker] = make()
        write_atomically(file, json.dumps(ids, indent=2).encode())
    return ids[tracker]


def nested(
    label: dict[str, Any], settings: dict[str, Any], options: Mapping[str, Any]
) -> dict[str, Any]:
    """The configuration as it is shown: to filter by any option, override or value.

    options: chosen of the groups of conf/, which become columns of their own; Hydra's own are left
        out. The rest of the settings stands below 'settings', whether it was overridden or not.
    """
    chosen = {key: value for key, value in options.items() if "/" not in key}
    return {**chosen, **{k: label[k] for k in ("seed", "overrides")}, "settings": settings}


def group(label: dict[str, Any], settings: dict[str, Any], options: Mapping[str, Any]) -> str:
    """Runs that belong together: of a sweep, an experiment or else a budget, timed by one clock."""
    within = options.get("sweeps") or options.get("experiment")
    return run_group(within, label["budget"], settings["budget"]["clock"])


LONGEST_JOB_TYPE = 55
"""Characters: with the hash of one that is cut 64, and W&B takes no more."""


def job_type(label: dict[str, Any]) -> str:
    """What tells the runs of a group apart beside scene and seed: the method, or else the sampler,
    and whatever else was overridden ('ours, sampler=uniform', 'uniform, model.hidden_features=64').
    """
    told = "method=" if label["method"] else "sampler="
    words = [word for word in label["overrides"].split(",") if not word.startswith(told)]
    others = [word for word in words if word != "default"]
    return shortened(", ".join([label["method"] or label["sampler"], *others]), LONGEST_JOB_TYPE)


def shown_name(label: dict[str, Any]) -> str:
    """Of a run; several may have the same."""
    return f"{label['scene']}/{job_type(label)}/{label['seed']}"


def _named(row: Row, name: Callable[[str], str]) -> dict[str, float]:
    """Without what is empty."""
    axes = ("step", "run_seconds")
    return {
        key if key in axes else name(key): value
        for key, value in row.items()
        if isinstance(value, int | float)
    }


def _section(key: str) -> str:
    """'hard_mape' is 'hard/mape', and 'patches_traced' is 'run/patches_traced'."""
    first, _, rest = key.partition("_")
    return f"{first}/{rest}" if first in SETS else f"run/{key}"


def _metrics(row: Row) -> dict[str, float]:
    """Those for which less is better, by their names in metrics.csv, without NaN."""
    given = {k: v for k, v in row.items() if k.partition("_")[0] in SETS and v not in (None, "")}
    found = {key: float(str(value)) for key, value in given.items()}
    return {key: value for key, value in found.items() if not math.isnan(value)}
