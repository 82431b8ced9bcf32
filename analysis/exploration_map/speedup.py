"""How much sooner exploration gets to the same error than uniform sampling."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from analysis.exploration_map.runs import TAIL, UNIFORM, run_time, scoring_cost
from analysis.speedup import time_to_stay_below
from analysis.statistics import expanded_interval

RESAMPLES = 400
SMOOTHED = 3
"""Neighbouring evaluations that a point of a curve is the mean of; training is noisy."""
MOST_SCORING = 1000.0
"""Training steps; scoring that may cost more than this may cost anything."""


@dataclass(frozen=True)
class Curves:
    """A method's runs of one setting, a row per seed: run time and error, [seeds, times]."""

    times: np.ndarray
    errors: np.ndarray


@dataclass(frozen=True)
class Speedup:
    """Run time of uniform sampling over that of exploration, to the same error.

    speedup: above 1 exploration is faster
    low, high: 95 % interval, by bootstrap over seeds, widened as few seeds need it
    bound: the speed-up is only a bound, since the faster one was there at its first test
    error_ratio: error of uniform sampling over that of exploration, after the same run time
    """

    speedup: float
    low: float
    high: float
    bound: bool
    error_ratio: float


@dataclass(frozen=True)
class Comparison:
    """A sampler against uniform sampling in one setting, both with or both without reuse.

    rows: of the setting; error: the column compared; cost_ratio: of rendering a batch, in steps
    """

    rows: pd.DataFrame
    sampler: str
    reuse: bool
    cost_ratio: float
    error: str = TAIL

    def curves(self, sampler: str, *, scoring: float) -> Curves:
        """Of one of the two. Raises ValueError where the setting has no run of it."""
        rows = self.rows[(self.rows["sampler"] == sampler) & (self.rows["reuse"] == self.reuse)]
        if rows.empty:
            raise ValueError(f"no run of '{sampler}' {'with' if self.reuse else 'without'} reuse")
        timed = rows.assign(time=run_time(rows, cost_ratio=self.cost_ratio, scoring=scoring))
        times, errors = (
            timed.pivot(index="seed", columns="step", values=column).to_numpy(dtype=float)
            for column in ("time", self.error)
        )
        return Curves(times, errors)

    def speedup(self) -> Speedup:
        """How much sooner the sampler gets to the same error.

        Both have the same run time. The error is the one that the worse of the two ends with, so
        the worse one takes all of the time. The better one takes the time from which on its error
        stays at or below that. Curves are means over the seeds, smoothed. The interval resamples
        seeds, the same for both.
        """
        uniform = self.curves(UNIFORM, scoring=0.0)
        explored = self.curves(self.sampler, scoring=scoring_cost(self.sampler))
        means = ratio_of_means(uniform, explored, np.arange(len(uniform.times)))
        low, high = _interval(uniform, explored, means.time)
        return Speedup(means.time, low, high, means.bound, means.error)

    def break_even_scoring(self) -> float:
        """What scoring a batch may cost, in training steps, for both to be as fast.

        0 where exploration is slower even for nothing, inf where it is faster at any cost up to
        `MOST_SCORING`.
        """
        uniform = self.curves(UNIFORM, scoring=0.0)
        seeds = np.arange(len(uniform.times))

        def log_ratio(scoring: float) -> float:
            explored = self.curves(self.sampler, scoring=scoring)
            return math.log(ratio_of_means(uniform, explored, seeds).time)

        if log_ratio(0.0) <= 0:
            return 0.0
        if log_ratio(MOST_SCORING) >= 0:
            return math.inf
        return float(brentq(log_ratio, 0.0, MOST_SCORING, xtol=1e-3))


class Ratios(NamedTuple):
    """Uniform sampling over exploration: run times to one error, errors after one run time.

    bound: the ratio of times is only a bound
    """

    time: float
    error: float
    bound: bool


def ratio_of_means(uniform: Curves, explored: Curves, seeds: np.ndarray) -> Ratios:
    """The ratios of the mean curves of these seeds; repeated ones count again."""
    series = [_log_mean(method, seeds) for method in (uniform, explored)]
    end = min(s[-1, 0] for s in series)
    ends = [np.interp(end, *s.T) for s in series]
    better = int(np.argmin(ends))
    time, bound = time_to_stay_below(_until(series[better], end), max(ends))
    ratio = end / time if better else time / end
    return Ratios(float(ratio), math.exp(ends[0] - ends[1]), bound)


def _log_mean(method: Curves, seeds: np.ndarray) -> np.ndarray:
    """[times, 2]: mean time, ln of the mean error, both smoothed."""
    means = [values[seeds].mean(axis=0) for values in (method.times, method.errors)]
    window = np.full(SMOOTHED, 1 / SMOOTHED)
    times, errors = (np.convolve(values, window, mode="valid") for values in means)
    return np.stack([times, np.log(errors)], axis=1)


def _until(series: np.ndarray, end: float) -> np.ndarray:
    """The series up to a time, which becomes its last."""
    before = series[series[:, 0] < end]
    return np.vstack([before, [end, np.interp(end, *series.T)]])


def _interval(uniform: Curves, explored: Curves, ratio: float) -> tuple[float, float]:
    """Of the ratio of times of all seeds; its logarithm is what is resampled."""
    n = len(uniform.times)
    if n == 1:
        return 0.0, float("inf")  # one seed says nothing of the others
    resamples = np.random.default_rng(0).integers(n, size=(RESAMPLES, n))
    ratios = [ratio_of_means(uniform, explored, seeds).time for seeds in resamples]
    centre = math.log(ratio)
    low, high = expanded_interval(centre, [(n, np.log(ratios) - centre)], n - 1)
    return math.exp(low), math.exp(high)
