"""Output that nobody reads any more: `ngi … | head` ends without a message."""

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def readers_may_leave() -> Iterator[None]:
    """Around a program: ends it with status 1, and silently, once who reads its output has left.

    A pipe or socket that breaks elsewhere raises what it raised.
    """
    try:
        try:
            yield
        finally:
            if sys.stdout is not None:  # None: of a process that was started without
                sys.stdout.flush()
    except BrokenPipeError:
        if not _nobody_reads():
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # flushed at the end again
        raise SystemExit(1) from None


def _nobody_reads() -> bool:
    try:
        output = sys.stdout.fileno()
    except (AttributeError, OSError):  # not of the system's
        return False
    poll = select.poll()
    poll.register(output, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))
