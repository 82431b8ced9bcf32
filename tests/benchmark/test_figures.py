from itertools import count

import numpy as np
import pytest

from ngi.benchmark import figures
from ngi.benchmark.figures import alternated, figure, in_turn, ratio, repeated


@pytest.mark.parametrize("size", [2, 3, 7, 20])
def test_median_and_quartiles_are_numpys(size: int) -> None:
    values = np.random.default_rng(size).exponential(size=size)
    measured = figure("x", values.tolist(), "s")
    lower, median, upper = np.quantile(values, [0.25, 0.5, 0.75], method="weibull")
    assert measured.median == pytest.approx(median)
    if size >= figures.FEWEST:  # of two values, Python's extrapolates
        assert (measured.lower, measured.upper) == pytest.approx((lower, upper))


def test_a_single_value_is_its_own_quartiles() -> None:
    measured = figure("x", [4.0], "s")
    assert (measured.lower, measured.median, measured.upper) == (4, 4, 4)


def test_a_ratio_compares_neighbours_in_time() -> None:
    assert ratio([2.0, 9.0], [1.0, 3.0]) == [2.0, 3.0]


def test_functions_take_turns() -> None:
    calls: list[str] = []
    seconds = in_turn(2, "", lambda: calls.append("a"), lambda: calls.append("b"))
    assert calls == ["a", "b", "a", "b", "a", "b"]
    assert [len(s) for s in seconds] == [2, 2]


def test_what_was_timed_elsewhere_is_kept_apart_and_without_the_warm_up() -> None:
    slow, fast = count(100), count()
    seconds = alternated(3, "", lambda: float(next(slow)), lambda: float(next(fast)))
    assert seconds == [[101, 102, 103], [1, 2, 3]]


@pytest.mark.parametrize(
    ("seconds", "expected"), [(1000.0, 20), (55.0, 6), (60.0, 6), (0.0, figures.FEWEST)]
)
def test_no_repeat_is_begun_when_the_time_is_up(seconds: float, expected: int) -> None:
    now = 0.0

    def take_ten_seconds() -> None:
        nonlocal now
        now += 10

    results = repeated(20, "", take_ten_seconds, seconds=seconds, timer=lambda: now)
    assert len(results) == expected


def test_few_repeats_stay_few() -> None:
    assert len(repeated(2, "", lambda: None, seconds=0)) == 2


def test_what_is_warm_is_called_no_more_than_it_has_to_be() -> None:
    calls = count()
    assert repeated(20, "", lambda: next(calls), seconds=0, fewest=1, warm=True) == [0]
