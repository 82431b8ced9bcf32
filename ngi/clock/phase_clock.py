"""Seconds by phase, and the run time that budgets and plots mean.

"Error against run time" compares methods at equal time, so evaluating and writing checkpoints,
which are ours and not the method's, stop the clock. Nothing of the method may go on meanwhile, so
that patches which other processes render are waited for first (`TrainingStream.catch_up`).

Run time is either that of the wall clock, or counted with measured costs (`ModelClock`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from ngi.clock.phase_events import PhaseEvents
from ngi.machine.energy import EnergyMeter

PHASES = ("explore", "render", "reuse", "score", "train", "other")
"""Phases that are run time; 'other' is whatever lies between the named ones.

'render' is the time in which training stands still for the renderer: it renders in this process,
or waits for patches that others render.
"""

PAUSES = ("evaluate", "checkpoint")
"""Phases during which run time stands still."""


class RunClock(Protocol):
    """The clock by which a budget ends, and by which errors are plotted."""

    name: str
    """'wall' or 'model'."""

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds so far of every phase and pause."""
        ...

    @property
    def run_seconds(self) -> float:
        """Seconds of run time: every phase but evaluation and checkpoints."""
        ...


class PhaseClock:
    """Wall-clock seconds by phase; phases nest, and only the innermost one runs.

    `seconds` maps every phase to its seconds so far. The clock stands still until `start`. Setting
    the system's clock changes nothing, and time that the machine sleeps does not count on Linux.
    Time that the process is stopped (SIGSTOP, Ctrl-Z) does: nothing tells it how long it stood
    still. To pause a run, end it (Ctrl-C) and start it again.

    Where a GPU works behind the host, `divide_by` has its events say which phase was at it; what
    they add up to stays the wall clock's.

    energy: is started and stopped with run time; None where nobody asks for it
    """

    name = "wall"

    def __init__(
        self,
        *,
        timer: Callable[[], float] = time.perf_counter,
        energy: EnergyMeter | None = None,
    ) -> None:
        self._timer = timer
        self.energy = energy or EnergyMeter([])
        self._events: PhaseEvents | None = None
        self._stack: list[str] = []
        self._since = 0.0
        self.seconds = dict.fromkeys((*PHASES, *PAUSES), 0.0)

    def divide_by(self, events: PhaseEvents) -> None:
        """Divides run time into phases by these, from the next `start` on."""
        self._events = events

    def start(self) -> None:
        """Starts or restarts the clock in phase 'other'; time spent before does not count."""
        self._stack = ["other"]
        self._since = self._timer()
        self.energy.start()
        if self._events is not None:
            self._events.begin()

    def stop(self) -> None:
        """Counts what has passed and stands still."""
        self._count()
        self._stack = []
        self.energy.stop()

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Counts the enclosed time as phase `name`; raises KeyError for an unknown phase.

        While the clock stands still only pauses are counted.
        """
        if name not in self.seconds:
            raise KeyError(f"unknown phase '{name}', expected one of {list(self.seconds)}")
        if not self._stack and name not in PAUSES:
            yield
            return
        self._count()
        self._stack.append(name)
        if name in PAUSES:
            self.energy.stop()
        try:
            yield
        finally:
            self._count()
            self._stack.pop()
            if name in PAUSES and self._stack:
                self.energy.start()

    @property
    def run_seconds(self) -> float:
        """Seconds of run time: every phase but evaluation and checkpoints."""
        self._count()
        return sum(self.seconds[name] for name in PHASES)

    def state_dict(self) -> dict[str, Any]:
        self._count()
        return {"seconds": dict(self.seconds), "joules": self.energy.joules}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self.seconds.update(state["seconds"])
        self.energy.load(state["joules"])
        self._since = self._timer()

    def _count(self) -> None:
        now = self._timer()
        if self._stack:
            phase, seconds = self._stack[-1], now - self._since
            self.seconds[phase] += seconds
            if self._events is not None:
                self._divide(self._events, phase, seconds)
        self._since = now

    def _divide(self, events: PhaseEvents, phase: str, seconds: float) -> None:
        if phase in PAUSES:
            events.begin()  # again and again, until run time goes on
        else:
            events.end(phase, seconds)
        for name, more in events.corrections().items():
            self.seconds[name] += more
