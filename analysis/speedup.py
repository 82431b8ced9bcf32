"""Time to equal error: how much sooner one method gets as far as another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from analysis.evidence import TimeRatio
from analysis.pairs import Pair
from analysis.runs import METRICS, Run
from analysis.statistics import estimate

Bound = Literal["", "at least", "at most"]


def log_error_series(runs: Sequence[Run], *, over: str = "run_seconds") -> list[np.ndarray]:
    """Per run [evaluations, 2]: run seconds, and ln of the geometric mean of the hard metrics.

    over: the column of `Run.history` that counts in place of run seconds, 'step' for one

    The metrics are those that every run has; evaluations with an error that is not finite and
    positive are left out, and all of a run that ends with one that is not finite.
    """
    whole = [run for run in runs if not run.diverged("hard")]
    keys = [
        key
        for key in (f"hard_{metric}" for metric in METRICS)
        if all(key in run.history and run.history[key].notna().any() for run in whole)
    ]
    series = []
    for run in runs:
        if run.diverged("hard"):
            series.append(np.empty((0, 2)))
            continue
        errors = run.history[keys].to_numpy(dtype=float)
        usable = (np.isfinite(errors) & (errors > 0)).all(axis=1) & bool(keys)
        times = run.history[over].to_numpy(dtype=float)[usable]
        values = np.log(errors[usable]).mean(axis=1) if keys else np.empty(0)
        order = times.argsort()
        series.append(np.stack([times[order], values[order]], axis=1))
    return series


def time_to_stay_below(series: np.ndarray, log_error: float) -> tuple[float, bool]:
    """Run time from which on the error stays at or below a value, and whether it is only a bound.

    series: as from `log_error_series`, interpolated linearly in the logarithm. Where all
    evaluations are below, the first one's time is an upper bound; where the last one is above, inf.
    """
    seconds, errors = series.T
    above = np.flatnonzero(errors > log_error)
    if not len(above):
        return float(seconds[0]), True
    last = above[-1]
    if last == len(errors) - 1:
        return math.inf, False
    share = (errors[last] - log_error) / (errors[last] - errors[last + 1])
    return float(seconds[last] + share * (seconds[last + 1] - seconds[last])), False


def time_ratio(pairs: Sequence[Pair]) -> TimeRatio | None:
    """Run times to the error with which the worse run of each pair ends: worse over better.

    Per seed, then the geometric mean over seeds with Student's 95 % interval of the logarithms.
    None where a pair's curves do not give it, as those of a run that diverged.
    """
    found = [_of_pair(pair) for pair in pairs]
    known = [pair for pair in found if pair is not None]
    return _combine(known) if len(known) == len(found) else None


def time_ratio_over_scenes(ratios: Sequence[TimeRatio | None]) -> TimeRatio | None:
    """The geometric mean over scenes; None where one is missing.

    Without an interval where a scene has none: one seed shows what happened once in each.
    """
    known = [ratio for ratio in ratios if ratio is not None]
    if len(known) < len(ratios):
        return None
    mean = _combine([(math.log(ratio.value), ratio.bound) for ratio in known])
    once = any(ratio.low is None for ratio in known)
    return replace(mean, low=None, high=None) if mean is not None and once else mean


def _of_pair(pair: Pair) -> tuple[float, Bound] | None:
    series = log_error_series([pair.better, pair.worse])
    if not all(map(len, series)):
        return None
    equal_error = max(errors[-1, 1] for errors in series)
    (better, better_bound), (worse, worse_bound) = (
        time_to_stay_below(errors, equal_error) for errors in series
    )
    if (better_bound and worse_bound) or not min(better, worse) > 0:
        return None
    bound: Bound = "at least" if better_bound else "at most" if worse_bound else ""
    return math.log(worse / better), bound


def _combine(ratios: Sequence[tuple[float, Bound]]) -> TimeRatio | None:
    bounds = {bound for _, bound in ratios if bound}
    if len(bounds) > 1:
        return None
    mean = estimate([ratio for ratio, _ in ratios])
    bound: Bound = bounds.pop() if bounds else ""
    if bound or mean.half_width is None:
        return TimeRatio(math.exp(mean.mean), None, None, bound)
    return TimeRatio(
        math.exp(mean.mean),
        math.exp(mean.mean - mean.half_width),
        math.exp(mean.mean + mean.half_width),
        "",
    )
