"""Means over seeds with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

LEVEL = 0.95


@dataclass(frozen=True)
class Estimate:
    """mean of n values; half_width of its 95 % interval, None for a single value."""

    mean: float
    half_width: float | None
    n: int


def estimate(values: Sequence[float]) -> Estimate:
    """Mean and 95 % interval of normally distributed values by Student's t with n - 1 degrees.

    NaN or Inf among the values makes the mean so. Raises ValueError for no values.
    """
    if not values:
        raise ValueError("no values to average")
    numbers = np.asarray(values, dtype=float)
    n = len(numbers)
    mean = sum(values) / n
    if n == 1 or not math.isfinite(mean):
        return Estimate(mean, None, n)
    standard_error = numbers.std(ddof=1) / math.sqrt(n)
    quantile = stats.t.ppf(0.5 + LEVEL / 2, df=n - 1)
    return Estimate(mean, float(quantile * standard_error), n)


def paired_difference(baseline: Mapping[int, float], other: Mapping[int, float]) -> Estimate | None:
    """Relative difference (other - baseline) / baseline over the seeds both have.

    Maps a seed to its value. Pairing takes out what the seed alone does to both. None where no
    seed is shared, a mean of NaN where a baseline is 0.
    """
    seeds = sorted(baseline.keys() & other.keys())
    if not seeds:
        return None
    return estimate([_relative_difference(baseline[seed], other[seed]) for seed in seeds])


def _relative_difference(baseline: float, other: float) -> float:
    return math.nan if baseline == 0 else (other - baseline) / baseline
