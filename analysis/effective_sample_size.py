"""How many independent draws the correlated states of a Markov chain are worth."""

from __future__ import annotations

import numpy as np
from scipy import fft


def effective_sample_size(series: np.ndarray) -> np.ndarray:
    """Of every series along the first axis: [T, ...] -> [...].

    T / τ with τ = 1 + 2 Σ ρ(lag), summed in pairs of lags as long as the pairs are positive: the
    initial positive sequence estimator (Geyer, Practical Markov Chain Monte Carlo, 1992, Sec. 3.3).
    It is meant for a stationary chain. At most T; 1 where the chain never moves, NaN where the
    series holds NaN.
    """
    length = len(series)
    deviations = series - series.mean(axis=0)
    spectrum = fft.rfft(deviations, n=2 * length, axis=0)
    covariance = fft.irfft(np.abs(spectrum) ** 2, n=2 * length, axis=0)[: length // 2 * 2]
    with np.errstate(invalid="ignore"):
        correlation = covariance / covariance[0]
    pairs = correlation[0::2] + correlation[1::2]
    positive = np.logical_and.accumulate(pairs > 0, axis=0)
    time = 2 * np.where(positive, pairs, 0).sum(axis=0) - 1
    size = length / np.maximum(time, 1.0)
    size = np.where(np.ptp(series, axis=0) == 0, 1.0, size)
    return np.where(np.isnan(series).any(axis=0), np.nan, size)
