import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.effective_sample_size import effective_sample_size


def autoregressive(coefficient: float, length: int, count: int) -> np.ndarray:
    """[length, count] x_t = coefficient x_{t-1} + noise, stationary from the start."""
    noise = np.random.default_rng(0).normal(size=(length, count))
    noise[0] /= np.sqrt(1 - coefficient**2)
    return lfilter([1], [1, -coefficient], noise, axis=0)


@pytest.mark.parametrize("coefficient", [0.0, 0.5, 0.9])
def test_an_autoregressive_series_has_its_closed_form(coefficient: float) -> None:
    length = 20_000
    sizes = effective_sample_size(autoregressive(coefficient, length, 30))
    assert sizes.shape == (30,)
    expected = length * (1 - coefficient) / (1 + coefficient)
    assert np.mean(sizes) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("length", [40, 41])
def test_it_is_geyers_sum_taken_literally(length: int) -> None:
    series = autoregressive(0.7, length, 1)[:, 0] + 5
    deviations = series - series.mean()
    covariances = [deviations[: length - lag] @ deviations[lag:] for lag in range(length)]
    time, lag = -1.0, 0
    while lag + 1 < length and covariances[lag] + covariances[lag + 1] > 0:
        time += 2 * (covariances[lag] + covariances[lag + 1]) / covariances[0]
        lag += 2
    assert effective_sample_size(series) == pytest.approx(length / time)


def test_a_chain_that_never_moves_says_one_thing_and_an_unknown_one_nothing() -> None:
    series = autoregressive(0.5, 100, 3)
    series[:, 1] = 0.3
    series[7, 2] = np.nan
    sizes = effective_sample_size(series)
    assert sizes[0] > 10
    assert sizes[1] == 1
    assert np.isnan(sizes[2])


def test_chains_that_swing_back_count_for_no_more_than_their_states() -> None:
    assert (effective_sample_size(autoregressive(-0.8, 500, 4)) == 500).all()
