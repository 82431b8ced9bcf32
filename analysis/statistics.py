"""Means and effects over seeds and frames, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # scipy.stats takes as long to import as pandas, and waits for its first use

if TYPE_CHECKING:
    import pandas as pd

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
    quantile = scipy.stats.t.ppf(0.5 + LEVEL / 2, df=n - 1)
    return Estimate(mean, float(quantile * standard_error), n)


def paired_difference(baseline: Mapping[Any, float], other: Mapping[Any, float]) -> Estimate | None:
    """Relative difference (other - baseline) / baseline over the seeds both have.

    Maps a seed, or scene and seed, to its value. Pairing takes out what the seed alone does to
    both. None where no seed is shared, a mean of NaN where a baseline is not above
    0.
    """
    differences = _relative_differences(baseline, other)
    return estimate([*differences.values()]) if differences else None


def difference_over_scenes(
    baseline: Mapping[Any, float], other: Mapping[Any, float]
) -> Estimate | None:
    """The same over scenes, each with the mean over its seeds for its one value.

    Maps scene and seed to its value. Seeds of one scene are no draws of scenes: the scatter between
    the scenes' means holds that of the seeds within them, and is all that tells of other scenes.
    """
    by_scene: dict[str, list[float]] = {}
    for (scene, _), difference in _relative_differences(baseline, other).items():
        by_scene.setdefault(scene, []).append(difference)
    return estimate([sum(of) / len(of) for of in by_scene.values()]) if by_scene else None


def shared_columns(metrics: pd.DataFrame) -> pd.DataFrame:
    """Those columns that all rows have which have any: without weights some lack LPIPS.

    Rows with an Inf, of runs that diverged, say nothing of that: their NaN was measured.
    """
    telling = metrics.notna().any(axis=1) & ~_diverged(metrics)
    return metrics.loc[:, ~metrics[telling].isna().any()]


def mean_of_shared(metrics: pd.DataFrame) -> pd.Series:
    """[rows] geometric mean of `shared_columns`; NaN where a row has none, or any Inf."""
    mean: pd.Series = np.exp(np.log(shared_columns(metrics)).mean(axis=1))
    return mean.mask(_diverged(metrics))


def _diverged(metrics: pd.DataFrame) -> pd.Series:
    return metrics.isin([math.inf]).any(axis=1)


def _relative_differences(
    baseline: Mapping[Any, float], other: Mapping[Any, float]
) -> dict[Any, float]:
    """Of what both have, in order. NaN to a baseline of 0, or below it, as relMSE's by chance."""
    return {
        key: (other[key] - baseline[key]) / baseline[key] if baseline[key] > 0 else math.nan
        for key in sorted(baseline.keys() & other.keys())
    }


def bootstrap_interval(
    centre: float, levels: Sequence[np.ndarray], *, resamples: int = 4000, confidence: float = LEVEL
) -> tuple[float, float]:
    """Interval of `centre`, a sum of means, by resampling each of `levels` with replacement.

    confidence: 0.95 if nothing else is said
    levels: the values behind each mean, 1-D, two or more; what has two sources of chance at once,
    seeds and test frames, has the means per seed and the means per frame. They are resampled
    independently (the crossed, two-level bootstrap) and the deviations from the means add up.

    It is an `expanded_interval`, with the degrees of freedom of Welch and Satterthwaite over the
    levels. Noise that belongs to neither seed nor frame counts in both levels, so that the interval
    is then too wide, not too narrow. tests/analysis/test_statistics.py measures the coverage.

    The resampling has a fixed seed: the same values give the same interval.
    """
    variances = np.array([values.var(ddof=1) / len(values) for values in levels])
    if not variances.sum() > 0:
        return centre, centre
    degrees = variances.sum() ** 2 / sum(
        variance**2 / (len(values) - 1) for variance, values in zip(variances, levels, strict=True)
    )
    generator = np.random.default_rng(0)
    deviations = []
    for values in levels:
        n = len(values)
        means = values[generator.integers(n, size=(resamples, n))].mean(axis=1)
        deviations.append((n, means - values.mean()))
    return expanded_interval(centre, deviations, degrees, confidence=confidence)


def expanded_interval(
    centre: float,
    deviations: Sequence[tuple[int, np.ndarray]],
    degrees: float,
    *,
    confidence: float = LEVEL,
) -> tuple[float, float]:
    """Interval of `centre` from a bootstrap's deviations, with the width that few values lack.

    deviations: per level the number n > 1 of its values, and [resamples] by how much a resample of
    them is off `centre`; those of all levels add up
    degrees: of freedom

    With three values the percentile bootstrap covers 75 % instead of 95 %: a resample's spread is
    too small by √((n-1)/n), and the normal quantile behind it too small for few values. As in
    Hesterberg, "What Teachers Should Know About the Bootstrap" (2015, Sec. 4.3), deviations are
    enlarged by √(n/(n-1)), and the quantiles by t/z. (His expanded percentiles do the latter by
    farther quantiles, which do not exist among the ten different resamples of three values.)
    """
    enlarged = sum(math.sqrt(n / (n - 1)) * of_level for n, of_level in deviations)
    tail = 0.5 - confidence / 2
    stretch = scipy.stats.t.ppf(tail, degrees) / scipy.stats.norm.ppf(tail)
    low, high = centre + stretch * np.quantile(enlarged, [tail, 1 - tail])
    return float(low), float(high)


def hedges_g(differences: Sequence[float] | np.ndarray) -> float | None:
    """Mean of paired differences in their standard deviations, without the bias of few pairs.

    Hedges' correction J = Γ(m/2) / (√(m/2) Γ((m-1)/2)) with m = n - 1 degrees of freedom. None for
    fewer than three pairs (J is 0 for two) and for pairs without spread.
    """
    values = np.asarray(differences, dtype=float)
    m = len(values) - 1
    spread = values.std(ddof=1) if m > 0 else 0.0
    if m < 2 or not spread > 0:
        return None
    correction = math.exp(math.lgamma(m / 2) - math.lgamma((m - 1) / 2)) / math.sqrt(m / 2)
    return float(correction * values.mean() / spread)


def seeds_to_decide(differences: np.ndarray, *, power: float = 0.8, most: int = 100) -> int | None:
    """Seeds with which the interval of the mean would leave out 0, with this power, at most `most`.

    differences: [seeds, frames], two seeds or more; the effect and the spread seen are taken for
    the true ones, the non-central t distribution says how often n seeds would show it. The spread
    between frames stays, however many seeds there are. None where more than `most` are needed.
    """
    seeds, frames = differences.shape
    by_seed, by_frame = differences.mean(axis=1), differences.mean(axis=0)
    n = np.arange(2, most + 1)
    variance_of_seeds = by_seed.var(ddof=1) / n
    degrees = (n - 1).astype(float)
    variance = variance_of_seeds
    if frames > 1:
        residuals = differences - by_seed[:, None] - by_frame + differences.mean()
        noise = (residuals**2).sum() / ((seeds - 1) * (frames - 1))
        between_frames = max(0.0, by_frame.var(ddof=1) - noise / seeds)
        variance_of_frames = (between_frames + noise / n) / frames
        variance = variance_of_seeds + variance_of_frames
        terms = variance_of_seeds**2 / (n - 1) + variance_of_frames**2 / (frames - 1)
        degrees = variance**2 / np.maximum(terms, np.finfo(float).tiny)
    centrality = abs(differences.mean()) / np.sqrt(np.maximum(variance, np.finfo(float).tiny))
    critical = scipy.stats.t.ppf(0.5 + LEVEL / 2, degrees)
    enough = scipy.stats.nct.sf(critical, degrees, centrality) >= power
    return int(n[enough][0]) if enough.any() else None
