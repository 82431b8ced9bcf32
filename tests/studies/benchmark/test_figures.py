import numpy as np
import pytest

from ngi.studies.benchmark.figures import figure, ratio


@pytest.mark.parametrize("size", [2, 3, 7, 20])
def test_median_and_quartiles_are_numpys(size: int) -> None:
    values = np.random.default_rng(size).exponential(size=size)
    measured = figure("x", values.tolist(), "s")
    lower, median, upper = np.quantile(values, [0.25, 0.5, 0.75], method="weibull")
    assert measured.median == pytest.approx(median)
    if size >= 3:  # of two values, Python's extrapolates
        assert (measured.lower, measured.upper) == pytest.approx((lower, upper))


def test_a_single_value_is_its_own_quartiles() -> None:
    measured = figure("x", [4.0], "s")
    assert (measured.lower, measured.median, measured.upper) == (4, 4, 4)


def test_a_ratio_compares_neighbours_in_time() -> None:
    assert ratio([2.0, 9.0], [1.0, 3.0]) == [2.0, 3.0]
