"""Seconds by phase, and the run time that budgets and plots mean.

"Error against run time" compares methods at equal time, so evaluating and writing checkpoints,
which are ours and not the method's, stop the clock. Nothing of the method may go on meanwhile, so
that patches which other processes render are waited for first (`TrainingStream.finish_rendering`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PHASES = ("explore", "render", "reuse", "score", "train", "other")
"""Phases that are run time; 'other' is whatever lies between the named ones.

'render' is the time in which training stands still for the renderer: it renders in this process,
or waits for patches that others render.
"""

PAUSES = ("evaluate", "checkpoint")
"""Phases during which run time stands still."""


class PhaseClock:
    """Wall-clock seconds by phase; phases nest, and only the innermost one runs.

    `seconds` maps every phase to its seconds so far. The clock stands still until `start`.
    """

    def __init__(self, *, timer: Callable[[], float] = time.perf_counter) -> None:
        self._timer = timer
        self._stack: list[str] = []
        self._since = 0.0
        self.seconds = dict.fromkeys((*PHASES, *PAUSES), 0.0)

    def start(self) -> None:
        """Starts or restarts the clock in phase 'other'; time spent before does not count."""
        self._stack = ["other"]
        self._since = self._timer()

    def stop(self) -> None:
        """Counts what has passed and stands still."""
        self._count()
        self._stack = []

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Counts the enclosed time as phase `name`; raises KeyError for an unknown phase."""
        if name not in self.seconds:
            raise KeyError(f"unknown phase '{name}', expected one of {list(self.seconds)}")
        self._count()
        self._stack.append(name)
        try:
            yield
        finally:
            self._count()
            self._stack.pop()

    @property
    def run_seconds(self) -> float:
        """Seconds of run time: every phase but evaluation and checkpoints."""
        self._count()
        return sum(self.seconds[name] for name in PHASES)

    def state_dict(self) -> dict[str, float]:
        self._count()
        return dict(self.seconds)

    def load_state_dict(self, state: dict[str, float]) -> None:
        self.seconds.update(state)
        self._since = self._timer()

    def _count(self) -> None:
        now = self._timer()
        if self._stack:
            self.seconds[self._stack[-1]] += now - self._since
        self._since = now
