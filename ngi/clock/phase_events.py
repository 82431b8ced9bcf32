"""What run time went into where a GPU works behind the host: events at the borders of phases."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol


class Event(Protocol):
    """As `torch.cuda.Event(enable_timing=True)`."""

    def record(self) -> None:
        """Has the GPU note the time once all that is queued now is done."""
        ...

    def query(self) -> bool:
        """Whether it has."""
        ...

    def elapsed_time(self, end_event: Any) -> float:
        """Milliseconds from its own time to another's."""
        ...


@dataclass(frozen=True)
class _Stretch:
    """Of run time in one phase, that took the host `seconds`. first: after a pause, or of all"""

    phase: str
    seconds: float
    begin: Event
    end: Event
    first: bool


class PhaseEvents:
    """Divides the host's time into phases as the GPU passes their borders.

    The host queues the work of one phase and waits for it in a later one. The GPU is at a border
    once the work before it is done; where it has nothing to do it is there when the host is, so
    that what the host takes by itself stays that phase's. By as much as the GPU is behind at the
    last border that it has passed, the phase after that border began later than the host says.
    Nothing is waited for.

    event: makes an event of the stream that the work is queued in
    """

    def __init__(self, event: Callable[[], Event]) -> None:
        self._event = event
        self._last: Event | None = None  # None before run time has begun
        self._begins = False
        self._pending: deque[_Stretch] = deque()
        self._behind = 0.0  # seconds, at the last border that the GPU has passed
        self._shortened = ""  # the phase that they were taken from

    def begin(self) -> None:
        """Here run time begins, or goes on."""
        self._last = self._here()
        self._begins = True

    def end(self, phase: str, seconds: float) -> None:
        """Here it has spent so many seconds of the host in this phase, since the last call."""
        if self._last is None:
            raise RuntimeError("run time ends that never began; call begin() first")
        here = self._here()
        self._pending.append(_Stretch(phase, seconds, self._last, here, first=self._begins))
        self._last, self._begins = here, False

    def corrections(self) -> dict[str, float]:
        """Seconds to be added to each phase, for what the GPU has passed since the last call.

        They add up to 0.
        """
        found: defaultdict[str, float] = defaultdict(float)
        while self._pending and self._pending[0].end.query():
            stretch = self._pending.popleft()
            by_gpu = 1e-3 * stretch.begin.elapsed_time(stretch.end)
            # What it does after the next pause has begun is not run time.
            behind = min(self._behind + by_gpu - stretch.seconds, self._left)
            found[stretch.phase] += behind - self._behind
            found[self._shortened or stretch.phase] += self._behind
            self._shortened = self._pending[0].phase if self._pending else stretch.phase
            found[self._shortened] -= behind
            self._behind = behind
        return dict(found)

    @property
    def _left(self) -> float:
        """Seconds of the host from the last border that the GPU has passed to the next pause."""
        seconds = 0.0
        for stretch in self._pending:
            if stretch.first:
                return seconds
            seconds += stretch.seconds
        return seconds if self._begins else math.inf

    def _here(self) -> Event:
        event = self._event()
        event.record()
        return event
