"""Figures: medians with quartiles."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One measured number with its quartiles; `limit` is what it is meant to reach, if anything.

    part: what part of the benchmark it belongs to. scene: what was rendered, if anything.
    """

    name: str
    median: float
    lower: float
    upper: float
    unit: str
    limit: str = ""
    part: str = ""
    scene: str = ""


def figure(name: str, values: Sequence[float], unit: str, limit: str = "") -> Figure:
    lower, upper = min(values), max(values)
    if len(values) > 2:  # of two, Python's lie outside of them
        lower, _, upper = statistics.quantiles(values, n=4)
    return Figure(name, statistics.median(values), lower, upper, unit, limit)


def ratio(numerator: Sequence[float], denominator: Sequence[float]) -> list[float]:
    return [a / b for a, b in zip(numerator, denominator, strict=True)]
