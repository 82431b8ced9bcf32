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
    mean itself for one seed; n: seeds, without those that diverged, which are none of it
    """

    seconds: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    n: int
    diverged: int = 0


def error_curve(runs: Sequence[Run], key: str, *, signed: bool = False) -> Curve | None:
    """The column `key` of metrics.csv over the runs of one scene and method.

    Evaluations that were NaN or Inf are left out, and so are runs whose last one was, which
    diverged. None where another run has no values, or all diverged.

    signed: as of `mean_curve`
    """
    whole = [run for run in runs if not run.diverged(key.partition("_")[0])]
    series = [finite_points(run, key) for run in whole]
    return mean_curve(series, signed=signed, diverged=len(runs) - len(whole))


def finite_points(run: Run, key: str) -> np.ndarray:
    """[evaluations, 2] run seconds and the column `key` of metrics.csv where it is finite."""
    if key not in run.history:
        return np.empty((0, 2))
    points = run.history[["run_seconds", key]].to_numpy(dtype=float)
    points = points[np.isfinite(points).all(axis=1)]
    in_order: np.ndarray = points[points[:, 0].argsort()]
    return in_order


def mean_curve(
    series: Sequence[np.ndarray], *, signed: bool = False, diverged: int = 0
) -> Curve | None:
    """The mean over seeds; None without any, and where one has no point or none at common times.

    series: per seed [points, 2], a time and a value, by time; diverged: how many are left out

    The seeds are evaluated at slightly different times: the curve has the first one's, as far as
    all cover them, and the others are interpolated linearly.

    The interval is Student's over the seeds, of the mean's logarithm (to first order its standard
    error is the mean's relative one), so that it stays above 0 with three seeds too.

    signed: for values that may be negative; the interval is that of the mean itself then
    """
    if not series or not all(map(len, series)):
        return None
    times = common_times(series)
    if not len(times):
        return None
    values = np.stack([np.interp(times, points[:, 0], points[:, 1]) for points in series])
    mean = values.mean(axis=0)
    half_width = np.array([_half_width(column) for column in values.T])
    if signed:
        return Curve(times, mean, mean - half_width, mean + half_width, len(series), diverged)
    factor = np.exp(np.divide(half_width, mean, out=np.zeros_like(mean), where=mean != 0))
    return Curve(times, mean, mean / factor, mean * factor, len(series), diverged)


def common_times(series: Sequence[np.ndarray]) -> np.ndarray:
    """The times of the first, as far as all reach and at the ends of that; none where they do not.

    series: [points, 2] each, a time and a value, by time
    """
    start = max(points[0, 0] for points in series)
    end = min(points[-1, 0] for points in series)
    return np.unique(series[0][:, 0].clip(start, end)) if start <= end else np.empty(0)


def _half_width(values: np.ndarray) -> float:
    return estimate(values.tolist()).half_width or 0.0
