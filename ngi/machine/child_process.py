"""Processes that must not outlive the one that started them."""

import multiprocessing
import os
from threading import Thread


def end_with_parent() -> None:
    """Of a pool's processes, the initializer: they end when their parent has, however it did.

    Where the parent was killed it could not tell them, and they would wait for work for ever.
    """
    Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
