"""Calls that may fail or hang without anybody waiting for them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from queue import Full, Queue
from threading import Event, Thread

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
                self._warn(f"takes no more calls, {CAPACITY} of them wait")
            self.dropped += 1

    def end(self, *, seconds: float) -> None:
        """Waits for the calls under way, for so long at most; says what was lost."""
        try:
            self._calls.put(None, timeout=seconds)
        except Full:
            pass  # nothing moves any more
        else:
            self._ended.wait(seconds)
        if not self._ended.is_set():
            self._warn(f"has not ended after {seconds:g} s and is left behind")
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
