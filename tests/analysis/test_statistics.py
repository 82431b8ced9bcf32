import math

import numpy as np
import pytest
from scipy import stats

from analysis.statistics import estimate, paired_difference


@pytest.mark.parametrize("n", [2, 3, 10])
def test_interval_is_students(n: int) -> None:
    values = np.random.default_rng(n).normal(3.0, 2.0, n).tolist()
    result = estimate(values)
    low, high = stats.t.interval(0.95, n - 1, loc=np.mean(values), scale=stats.sem(values))
    assert result.n == n
    assert result.half_width is not None
    assert result.mean - result.half_width == pytest.approx(low)
    assert result.mean + result.half_width == pytest.approx(high)


def test_interval_of_three_values_by_hand() -> None:
    result = estimate([1.0, 2.0, 3.0])  # standard deviation 1, tabulated t(0.975, 2) = 4.303
    assert result.mean == 2.0
    assert result.half_width == pytest.approx(4.303 / math.sqrt(3), abs=1e-3)


def test_one_value_has_no_interval_and_none_no_mean() -> None:
    assert estimate([0.5]).half_width is None
    with pytest.raises(ValueError, match="no values"):
        estimate([])


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_values_that_are_not_finite_are_not_dropped(bad: float) -> None:
    result = estimate([1.0, bad])
    assert not math.isfinite(result.mean)
    assert result.half_width is None


def test_relative_difference_to_zero_is_undefined() -> None:
    result = paired_difference({0: 0.0, 1: 1.0}, {0: 0.5, 1: 0.5})
    assert result is not None
    assert math.isnan(result.mean)
    assert result.half_width is None


def test_pairs_are_made_by_seed() -> None:
    baseline = {0: 1.0, 1: 10.0, 2: 100.0, 7: 5.0}
    other = {2: 90.0, 1: 9.0, 0: 0.9, 8: 5.0}
    result = paired_difference(baseline, other)
    assert result is not None
    assert (result.n, result.mean) == (3, pytest.approx(-0.1))
    assert result.half_width == pytest.approx(0.0, abs=1e-12)
    assert paired_difference({0: 1.0}, {1: 1.0}) is None
