import numpy as np
import pytest

from ngi.studies.benchmark.figures import figure, ratio


@pytest.mark.parametrize("size", [3, 7, 20])
def test_median_and_quartiles_are_numpys(size: int) -> None:
    values = np.random.default_rng(size).exponential(size=size)
    measured = figure("x", values.tolist(), "s")
    lower, median, upper = np.quantile(values, [0.25, 0.5, 0.75], method="weibull")
    assert measured.median == pytest.approx(median)
    assert (measured.lower, measured.upper) == pytest.approx((lower, upper))


@pytest.mark.parametrize("values", [[4.0], [10.0, 14.0]])
def test_quartiles_of_few_values_are_the_ends(values: list[float]) -> None:
    measured = figure("x", values, "s")
    found = (measured.lower, measured.median, measured.upper)
    assert found == (min(values), sum(values) / len(values), max(values))


def test_a_ratio_compares_neighbours_in_time() -> None:
    assert ratio([2.0, 9.0], [1.0, 3.0]) == [2.0, 3.0]
