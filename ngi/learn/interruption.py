"""SIGTERM, SIGHUP and Ctrl-C: a run ends soon, the same command goes on without a step lost."""

import logging
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, ParamSpec, Self, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

log = logging.getLogger(__name__)

SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)


class Interrupted(SystemExit):
    """Ends the process, and the sweep it is in, with status 128 + the signal's number."""

    def __init__(self, number: signal.Signals) -> None:
        super().__init__(number)
        self.number = number
        self.code = 128 + number


class Interruption:
    """The context within which `SIGNALS` raise `Interrupted`: at once, unless `deferred`.

    Further signals change nothing, but that a second SIGINT raises KeyboardInterrupt at once.

    of: what the log calls the work that was ended
    """

    def __init__(self, *, of: str) -> None:
        self._of = of
        self._received: signal.Signals | None = None
        self._deferred = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        for number in SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:  # by nohup, or in the background
                self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, _type: object, exception: BaseException | None, _traceback: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if isinstance(exception, Interrupted):
            log.warning(
                "%s: ended by %s; to resume, repeat the command", self._of, exception.number.name
            )

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Lets what is in hand be finished: a signal raises at the next `check`, or at the end."""
        self._deferred = True
        try:
            yield
        except SystemExit:
            self.check()  # Lightning ends by one of its own, with status 0, if it is faster
            raise
        finally:
            self._deferred = False
        self.check()

    def check(self) -> None:
        """Raises `Interrupted` where a signal has come."""
        if self._received is not None:
            raise Interrupted(self._received)

    def checked(self, function: Callable[P, T]) -> Callable[P, T]:
        """The same function, with a `check` before each call."""

        def checking(*arguments: P.args, **named: P.kwargs) -> T:
            self.check()
            return function(*arguments, **named)

        return checking

    def _receive(self, number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGINT:
            signal.signal(signal.SIGINT, self._before[signal.SIGINT])
        if self._received is not None:
            return
        self._received = signal.Signals(number)
        if not self._deferred:
            self.check()
