"""Seconds of functions that are called in turn, so that a busy machine slows all of them."""

import math
import time
from collections.abc import Callable
from typing import TypeVar

import torch
from tqdm import tqdm

T = TypeVar("T")

FEWEST = 3
"""Repeats that are made however long they take."""


def repeated(
    repeats: int,
    title: str,
    function: Callable[[], T],
    *,
    seconds: float = math.inf,
    fewest: int = FEWEST,
    warm: bool = False,
    timer: Callable[[], float] = time.perf_counter,
) -> list[T]:
    """What a function gives when it is called `repeats` times after a warm-up of one.

    seconds: after so long no further call is begun, once there were `fewest`.
    warm: there is nothing to warm up any more.
    """
    if not warm:
        function()
    results: list[T] = []
    end = timer() + seconds
    for _ in tqdm(range(repeats), desc=title, leave=False):
        if len(results) >= fewest and timer() >= end:
            break
        results.append(function())
    return results


def alternated(
    repeats: int,
    title: str,
    *timers: Callable[[], float],
    seconds: float = math.inf,
    warm: bool = False,
) -> list[list[float]]:
    """What each of several functions gives that time themselves, called in turn as `repeated`."""
    rounds = repeated(
        repeats, title, lambda: [timer() for timer in timers], seconds=seconds, warm=warm
    )
    return [list(values) for values in zip(*rounds, strict=True)]


def in_turn(
    repeats: int, title: str, *functions: Callable[[], object], seconds: float = math.inf
) -> list[list[float]]:
    """Seconds of each function, called in turn as `repeated`; a GPU is waited for."""
    return alternated(repeats, title, *map(timed, functions), seconds=seconds)


def timed(function: Callable[[], object]) -> Callable[[], float]:
    """The function, giving its seconds."""

    def call() -> float:
        start = time.perf_counter()
        function()
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        return time.perf_counter() - start

    return call
