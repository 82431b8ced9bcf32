"""Independent pieces of work on a thread each, where PyTorch's own threads would wait."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Barrier
from typing import TypeVar

import torch

Piece = TypeVar("Piece")
Result = TypeVar("Result")


def in_parallel(function: Callable[[Piece], Result], pieces: Iterable[Piece]) -> list[Result]:
    """What `function` makes of each piece, without gradients.

    As many pieces at a time as PyTorch has threads, each on one thread: of many short operations
    some are too small to be divided, and all end with a wait for every thread. The pieces and
    their results are the same whatever the number of threads. Autocast is off in there.
    """
    threads = torch.get_num_threads()

    @torch.no_grad()
    def made(piece: Piece) -> Result:
        with torch.autocast("cpu", enabled=False):
            return function(piece)

    run = map if threads == 1 else _pool(threads).map
    return list(run(made, pieces))


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Of threads on which PyTorch divides nothing."""
    all_there = Barrier(threads + 1)

    def alone(_: int) -> None:
        torch.get_num_threads()  # or a thread's first operation would set it to everybody's number
        torch.set_num_threads(1)
        all_there.wait()

    pool = ThreadPoolExecutor(threads, thread_name_prefix="ngi-pieces")
    for number in range(threads):
        pool.submit(alone, number)
    all_there.wait()
    torch.set_num_threads(threads)  # of this thread, and of those that begin later
    return pool
