"""Notices workers that do not answer any more, and ends them as if they had died."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ngi.render.worker_protocol import Worker, WorkerDiedError

STARTING_SECONDS = 1800.0
"""For loading a scene and compiling its kernels, and for a reply while none has come yet."""

SHORTEST_SECONDS = 120.0
TIMES_THE_SLOWEST = 10.0
"""For every other reply: so many times the slowest one so far, patch for patch."""

TICK = 1.0
"""Seconds between two looks."""


@dataclass(eq=False)
class _Wait:
    worker: Worker
    limit: float
    waited: float = 0.0
    """Ticks, not clock time: a program that was itself stopped has not been waiting."""
    ended: bool = False


class Watchdog:
    """How long replies may take, and a thread that kills workers which take longer.

    A limit is many times what such a request has taken, and doubles with every worker lost in a
    row, so that a slow machine ends nobody for ever. What is rendered does not depend on it.
    """

    def __init__(self) -> None:
        self._slowest: float | None = None  # seconds per patch, of the replies so far
        self._waits: list[_Wait] = []
        self._lock = threading.Lock()  # guards the above
        self._ended = threading.Event()

    def limit(self, patches: int, *, lost: int) -> float:
        """Seconds that a reply may take. patches: 0 for the first one, after the start.

        lost: workers that have died or been ended in a row.
        """
        if not patches or self._slowest is None:
            return STARTING_SECONDS * 2.0**lost
        return max(SHORTEST_SECONDS, TIMES_THE_SLOWEST * self._slowest * patches) * 2.0**lost

    @contextmanager
    def waiting(self, worker: Worker, *, patches: int, lost: int) -> Iterator[None]:
        """Around `worker.receive`; its WorkerDiedError says so where the watchdog ended it."""
        wait = _Wait(worker, self.limit(patches, lost=lost))
        with self._lock:
            self._waits.append(wait)
        try:
            yield
        except WorkerDiedError:
            if wait.ended:
                raise WorkerDiedError(f"killed: no answer within {wait.limit:.0f} s") from None
            raise
        finally:
            with self._lock:
                self._waits.remove(wait)
        if patches:
            with self._lock:
                self._slowest = max(self._slowest or 0.0, wait.waited / patches)

    def run(self) -> None:
        """The thread; until `end`."""
        while not self._ended.wait(TICK):
            with self._lock:
                for wait in self._waits:
                    wait.waited += TICK
                    if wait.waited > wait.limit and not wait.ended:
                        wait.ended = True
                        wait.worker.kill()

    def end(self) -> None:
        self._ended.set()
