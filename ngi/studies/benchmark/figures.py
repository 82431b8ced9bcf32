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
    quartiles = statistics.quantiles(values, n=4) if len(values) > 1 else [values[0]] * 3
    return Figure(name, statistics.median(values), quartiles[0], quartiles[2], unit, limit)


def ratio(numerator: Sequence[float], denominator: Sequence[float]) -> list[float]:
    return [a / b for a, b in zip(numerator, denominator, strict=True)]
