import math

import numpy as np
import pytest
from scipy import stats

from analysis.statistics import (
    bootstrap_interval,
    difference_over_scenes,
    estimate,
    hedges_g,
    paired_difference,
    seeds_to_decide,
)


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


def test_relative_difference_to_less_than_zero_is_no_gain() -> None:
    """Noise-free relMSE is below 0 by chance."""
    result = paired_difference({0: -0.0002}, {0: 0.0001})
    assert result is not None
    assert math.isnan(result.mean)


def test_pairs_are_made_by_seed() -> None:
    baseline = {0: 1.0, 1: 10.0, 2: 100.0, 7: 5.0}
    other = {2: 90.0, 1: 9.0, 0: 0.9, 8: 5.0}
    result = paired_difference(baseline, other)
    assert result is not None
    assert (result.n, result.mean) == (3, pytest.approx(-0.1))
    assert result.half_width == pytest.approx(0.0, abs=1e-12)
    assert paired_difference({0: 1.0}, {1: 1.0}) is None


def test_seeds_of_a_scene_are_one_draw_of_scenes() -> None:
    """Two scenes, whose many seeds agree, tell what the mean over scenes is to ± 127 %."""
    errors = {("box", 0): 0.9, ("box", 1): 1.9, ("box", 2): 2.6, ("hall", 0): 1.3, ("hall", 7): 1.0}
    baseline = {("box", 0): 1.0, ("box", 1): 2.0, ("box", 2): 3.0, ("hall", 0): 1.0}
    result = difference_over_scenes(baseline, errors)
    by_scene = [-(0.1 + 0.05 + 0.4 / 3) / 3, 0.3]
    assert result is not None
    assert (result.n, result.mean) == (2, pytest.approx(np.mean(by_scene)))
    interval = stats.ttest_1samp(by_scene, 0).confidence_interval()
    assert result.half_width == pytest.approx((interval.high - interval.low) / 2)
    alone = difference_over_scenes({("box", 0): 1.0, ("box", 1): 2.0}, errors)
    assert alone is not None
    assert (alone.n, alone.half_width) == (1, None)
    assert difference_over_scenes(baseline, {("hall", 7): 1.0}) is None


def coverage(seeds: int, spreads: tuple[float, float, float], trials: int = 500) -> float:
    """How often the interval holds the true mean 0; spreads: between seeds, frames, of noise."""
    generator = np.random.default_rng(seeds)
    of_seeds, of_frames, of_noise = spreads
    hits = 0
    for _ in range(trials):
        values = of_seeds * generator.normal(size=(seeds, 1))
        values = values + of_frames * generator.normal(size=(1, 10))
        values = values + of_noise * generator.normal(size=(seeds, 10))
        levels = [values.mean(axis=1), values.mean(axis=0)]
        low, high = bootstrap_interval(values.mean(), levels, resamples=500)
        hits += low <= 0 <= high
    return hits / trials


@pytest.mark.parametrize("seeds", [3, 5])
@pytest.mark.parametrize("spreads", [(1, 0, 0), (1, 1, 1), (1, 0.3, 0.3), (0.3, 1, 0.3)])
def test_interval_covers_the_truth_as_often_as_it_says(seeds, spreads) -> None:
    # 500 trials have a standard error of 1 %; the plain bootstrap of three seeds covers 75 %.
    assert 0.90 <= coverage(seeds, spreads) <= 0.985


def test_noise_of_single_frames_makes_the_interval_wider_not_narrower() -> None:
    assert coverage(3, (0.1, 0.1, 1)) > 0.94


def test_bootstrap_of_many_values_is_the_normal_interval() -> None:
    values = np.random.default_rng(0).normal(2.0, 3.0, 400)
    low, high = bootstrap_interval(values.mean(), [values], resamples=20000)
    expected = stats.t.interval(0.95, 399, loc=values.mean(), scale=stats.sem(values))
    assert (low, high) == pytest.approx(expected, abs=0.02)
    assert bootstrap_interval(values.mean(), [values]) == bootstrap_interval(
        values.mean(), [values]
    )


def test_bootstrap_of_few_values_is_as_wide_as_students_interval() -> None:
    ratios = []
    for values in np.random.default_rng(2).normal(size=(60, 8)):
        low, high = bootstrap_interval(values.mean(), [values])
        ratios.append((high - low) / (2 * stats.t.ppf(0.975, 7) * stats.sem(values)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)


def test_bootstrap_adds_the_variances_of_its_levels() -> None:
    generator = np.random.default_rng(1)
    seeds, frames = generator.normal(size=200), generator.normal(size=300)
    low, high = bootstrap_interval(5.0, [seeds, 2 * frames], resamples=20000)
    spread = math.hypot(stats.sem(seeds), 2 * stats.sem(frames))
    assert (low, high) == pytest.approx((5 - 1.96 * spread, 5 + 1.96 * spread), rel=0.01)


def test_values_without_spread_have_an_interval_of_no_width() -> None:
    assert bootstrap_interval(0.5, [np.full(3, 0.5), np.full(10, 0.5)]) == (0.5, 0.5)


def test_hedges_g_has_no_bias() -> None:
    # Four pairs with a true effect of 0.8 standard deviations; uncorrected, the mean is 1.1.
    samples = np.random.default_rng(0).normal(0.8, 1.0, size=(20000, 5))
    assert np.mean([hedges_g(sample) for sample in samples]) == pytest.approx(0.8, abs=0.02)
    assert hedges_g([1.0, 2.0, 3.0]) == pytest.approx(2.0 / math.sqrt(math.pi))
    for undefined in ([1.0], [1.0, 2.0], [1.0, 1.0, 1.0], [1.0, math.nan, 2.0]):
        assert hedges_g(undefined) is None


def power_of_t_test(effect: float, n: int) -> float:
    samples = np.random.default_rng(n).normal(effect, 1.0, size=(40000, n))
    return float((stats.ttest_1samp(samples, 0.0, axis=1).pvalue < 0.05).mean())


@pytest.mark.parametrize("effect", [0.5, 1.0, 2.5])
def test_so_many_seeds_give_the_power(effect: float) -> None:
    spread = np.array([-1.0, 0.0, 1.0])  # standard deviation 1
    n = seeds_to_decide((effect + spread)[:, None])
    assert n is not None
    assert power_of_t_test(effect, n) >= 0.79
    assert power_of_t_test(effect, n - 1) <= 0.81
    assert seeds_to_decide((-effect + spread)[:, None]) == n


def test_more_seeds_than_a_hundred_are_none() -> None:
    assert seeds_to_decide(np.array([[0.0], [1.0], [-0.9]])) is None


def test_seeds_do_not_help_against_the_spread_between_frames() -> None:
    by_seed = np.array([[0.01], [0.0], [-0.01]])
    frames = np.array([[-1.0, 0.0, 1.0, 0.3, -0.3]])
    assert seeds_to_decide(0.2 + by_seed + frames) is None
    assert seeds_to_decide(0.2 + by_seed + 0.01 * frames) == 2
