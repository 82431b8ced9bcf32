import csv
import math

import numpy as np
import pytest

from analysis.pairs import pair_runs
from analysis.runs import METRICS, find_runs
from analysis.speedup import TimeRatio, time_ratio, time_ratio_over_scenes, time_to_stay_below


def write_curve(folder, errors) -> None:  # type: ignore[no-untyped-def]
    """Evaluations at 10, 20, … seconds."""
    with (folder / "metrics.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["step", "run_seconds", *(f"hard_{metric}" for metric in METRICS)])
        for index, error in enumerate(errors, start=1):
            writer.writerow([index, 10.0 * index, *[error] * len(METRICS)])


@pytest.fixture
def ratio(make_method, tmp_path):  # type: ignore[no-untyped-def]
    def of(*curves):  # type: ignore[no-untyped-def]
        for seed, (better, worse) in enumerate(curves):
            for method, errors in (("active_exploration", better), ("uniform", worse)):
                steps = len(errors)  # one from one evaluation to the next
                folder = make_method(method, seed=seed, change=lambda r, n=steps: r.update(steps=n))
                write_curve(folder, errors)
        runs = find_runs(tmp_path)[0]
        return time_ratio(pair_runs(runs, "living-room", "active_exploration", "uniform"))

    return of


def test_ratio_of_exponentials_is_that_of_their_rates(ratio) -> None:
    seconds = 10.0 * np.arange(1, 31)
    found = ratio((np.exp(-0.03 * seconds), np.exp(-0.02 * seconds)))
    assert found == TimeRatio(pytest.approx(1.5), None, None, "")


def test_claimed_method_may_be_the_slower_one(ratio) -> None:
    seconds = 10.0 * np.arange(1, 31)
    assert ratio((np.exp(-0.01 * seconds), np.exp(-0.02 * seconds))).value == pytest.approx(0.5)


def test_seeds_give_an_interval(ratio) -> None:
    seconds = 10.0 * np.arange(1, 31)
    rates = (0.03, 0.035, 0.04)
    found = ratio(*((np.exp(-rate * seconds), np.exp(-0.02 * seconds)) for rate in rates))
    logarithms = np.log([1.5, 1.75, 2.0])
    half = 4.303 * logarithms.std(ddof=1) / math.sqrt(3)
    assert found.value == pytest.approx(np.exp(logarithms.mean()))
    assert found.low == pytest.approx(np.exp(logarithms.mean() - half), rel=1e-3)
    assert found.high == pytest.approx(np.exp(logarithms.mean() + half), rel=1e-3)


def test_error_has_to_stay_below() -> None:
    series = np.array([[10.0, 3.0], [20.0, 1.0], [30.0, 2.0], [40.0, 0.0]])
    assert time_to_stay_below(series, 1.5) == (pytest.approx(32.5), False)
    assert time_to_stay_below(series, 2.0) == (pytest.approx(15.0), False)
    assert time_to_stay_below(series, -1.0) == (math.inf, False)
    assert time_to_stay_below(series, 5.0) == (10.0, True)


def test_what_was_reached_before_the_first_evaluation_is_a_bound(ratio) -> None:
    assert ratio(([0.2, 0.1], [0.8, 0.4])) == TimeRatio(pytest.approx(2.0), None, None, "at least")


def test_bound_for_the_other_method(ratio) -> None:
    assert ratio(([0.8, 0.4], [0.2, 0.1])) == TimeRatio(pytest.approx(0.5), None, None, "at most")


def test_opposite_bounds_give_nothing(ratio) -> None:
    assert ratio(([0.8, 0.4], [0.2, 0.1]), ([0.2, 0.1], [0.8, 0.4])) is None


def test_no_evaluation_that_can_be_used_gives_nothing(ratio) -> None:
    assert ratio(([math.nan, math.inf], [0.2, 0.1])) is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, 0.0])
def test_evaluations_that_failed_are_left_out(ratio, bad) -> None:
    found = ratio(([0.4, bad, 0.1], [0.4, 0.2, 0.2]))
    assert found.value == pytest.approx(1.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("which", [0, 1])
def test_a_run_that_diverged_has_no_time_to_equal_error(ratio, which, bad) -> None:
    curves = ([1.0, 0.5, bad], [1.0, 0.8, 0.6])
    assert ratio((curves[which], curves[1 - which])) is None


def test_scenes_are_averaged_geometrically() -> None:
    two, eight = (TimeRatio(value, None, None, "") for value in (2.0, 8.0))
    assert time_ratio_over_scenes([two, eight]) == TimeRatio(pytest.approx(4.0), None, None, "")
    seeds = [TimeRatio(ratio.value, 1.0, 9.0, "") for ratio in (two, eight)]
    assert time_ratio_over_scenes(seeds).low < 4 < time_ratio_over_scenes(seeds).high
    assert time_ratio_over_scenes([two, seeds[1]]).low is None
    assert time_ratio_over_scenes([two, None]) is None
    bounded = time_ratio_over_scenes([two, TimeRatio(8.0, None, None, "at least")])
    assert (bounded.bound, bounded.low) == ("at least", None)
