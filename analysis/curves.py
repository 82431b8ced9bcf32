"""Error against run time, brought to common times so that seeds can be averaged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.runs import Run
from analysis.statistics import estimate


@dataclass(frozen=True)
class Curve:
    """A method's error over time. All arrays have shape [times].

    seconds: run time without evaluations; mean: over the seeds; low, high: its 95 % interval, the
    mean itself for one seed; n: seeds
    """

    seconds: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    n: int


def error_curve(runs: Sequence[Run], key: str, *, signed: bool = False) -> Curve | None:
    """The column `key` of metrics.csv over the runs of one scene and method.

    The seeds are evaluated at slightly different times: the curve has the first run's, as far as
    all runs cover them, and the others are interpolated linearly. Evaluations that were NaN or
    Inf are left out. None where a run has no values.

    The interval is Student's over the seeds, of the mean's logarithm (to first order its standard
    error is the mean's relative one), so that it stays above 0 with three seeds too.

    signed: for values that may be negative; the interval is that of the mean itself then
    """
    series = []
    for run in runs:
        if key not in run.history:
            return None
        points = run.history[["run_seconds", key]].to_numpy(dtype=float)
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return None
        series.append(points[points[:, 0].argsort()])
    times = common_times(series)
    if not len(times):
        return None
    values = np.stack([np.interp(times, points[:, 0], points[:, 1]) for points in series])
    mean = values.mean(axis=0)
    half_width = np.array([_half_width(column) for column in values.T])
    if signed:
        return Curve(times, mean, mean - half_width, mean + half_width, len(runs))
    relative = np.divide(half_width, mean, out=np.zeros_like(mean), where=mean != 0)
    return Curve(times, mean, mean / np.exp(relative), mean * np.exp(relative), len(runs))


def common_times(series: Sequence[np.ndarray]) -> np.ndarray:
    """The times of the first, as far as all reach and at the ends of that; none where they do not.

    series: [points, 2] each, a time and a value, by time
    """
    start = max(points[0, 0] for points in series)
    end = min(points[-1, 0] for points in series)
    return np.unique(series[0][:, 0].clip(start, end)) if start <= end else np.empty(0)


def _half_width(values: np.ndarray) -> float:
    return estimate(values.tolist()).half_width or 0.0
