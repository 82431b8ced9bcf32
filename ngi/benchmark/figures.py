"""Figures: medians with quartiles of things timed in turn."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from tqdm import tqdm


@dataclass(frozen=True)
class Figure:
    """One measured number with its quartiles; `limit` is what it is meant to reach, if anything."""

    name: str
    median: float
    lower: float
    upper: float
    unit: str
    limit: str = ""


def figure(name: str, values: Sequence[float], unit: str, limit: str = "") -> Figure:
    quartiles = statistics.quantiles(values, n=4) if len(values) > 1 else [values[0]] * 3
    return Figure(name, statistics.median(values), quartiles[0], quartiles[2], unit, limit)


def in_turn(repeats: int, title: str, *functions: Callable[[], object]) -> list[list[float]]:
    """Seconds of each function, called in turn `repeats` times after a warm-up of one."""
    seconds: list[list[float]] = [[] for _ in functions]
    for function in functions:
        function()
    for _ in tqdm(range(repeats), desc=title, leave=False):
        for function, times in zip(functions, seconds, strict=True):
            start = time.perf_counter()
            function()
            if torch.cuda.is_available():
                torch.cuda.synchronize()
            times.append(time.perf_counter() - start)
    return seconds


def ratio(numerator: Sequence[float], denominator: Sequence[float]) -> list[float]:
    return [a / b for a, b in zip(numerator, denominator, strict=True)]


def table(figures: Sequence[Figure]) -> str:
    width = max(len(f.name) for f in figures)
    return "\n".join(
        f"{f.name:<{width}}  {f.median:9.4g} {f.unit}"
        + (f"  ({f.lower:.4g} – {f.upper:.4g})" if f.lower != f.upper else "")
        + (f"  wanted {f.limit}" if f.limit else "")
        for f in figures
    )
