import math

import numpy as np
import pytest
import torch
from scipy import optimize, stats

from ngi.explore import Importance

VALUES = torch.tensor([0.0, 1.0, 2.0, 5.0])


def test_the_density_is_the_mixture_of_its_formula() -> None:
    found = Importance(uniform_share=0.2, power=2.0).probabilities(VALUES)
    squares = np.array([0.0, 1.0, 4.0, 25.0])
    expected = 0.2 / 4 + 0.8 * squares / squares.sum()
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 1.2, 2.0, 2.8])
def test_nothing_is_drawn_more_often_than_the_bound(ratio: float) -> None:
    """Mixed with so much of the uniform density as is missing, found here by bisection."""
    mixed = Importance(uniform_share=0.2, power=2.0).probabilities(VALUES).numpy()
    found = Importance(uniform_share=0.2, power=2.0, largest_ratio=ratio).probabilities(VALUES)
    capped = np.minimum(mixed, ratio / 4)
    share = optimize.brentq(lambda x: (capped + x * (ratio / 4 - capped)).sum() - 1, 0, 1)
    np.testing.assert_allclose(found.numpy(), capped + share * (ratio / 4 - capped), rtol=1e-9)
    assert found.max().item() <= ratio / 4 + 1e-12
    assert found.sum().item() == pytest.approx(1, abs=1e-12)
    assert found.min().item() >= 0.2 / 4


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.9])
def test_equal_values_make_a_uniform_density_under_the_closest_bound(share: float) -> None:
    """Rounding takes all of them above 1 / m or below it."""
    importance = Importance(uniform_share=share, largest_ratio=1.0)
    for count in range(1, 200):
        found = importance.probabilities(torch.ones(count))
        np.testing.assert_allclose(found.numpy(), np.full(count, 1 / count), rtol=1e-12)


def test_draws_of_several_keep_to_the_bound() -> None:
    """Of 64 candidates one has all the value; four are drawn, eight times as often at most."""
    values = torch.eye(1, 64)[0]
    importance = Importance(uniform_share=0.1, largest_ratio=8.0)
    generator = torch.Generator().manual_seed(2)
    drawn = torch.cat([importance.draw(values, 4, generator)[0] for _ in range(2000)])
    often = np.bincount(drawn.numpy(), minlength=64) / 2000
    assert 5 / 16 < often[0] <= 8 / 16
    assert stats.chisquare(2000 * often[1:]).pvalue > 0.01  # the rest goes to all others


def test_a_bound_that_nothing_reaches_changes_no_bit() -> None:
    plain, bounded = (Importance(uniform_share=0.2, largest_ratio=r) for r in (math.inf, 3.0))
    assert torch.equal(plain.probabilities(VALUES), bounded.probabilities(VALUES))


def test_weights_undo_the_density_and_are_bounded() -> None:
    """The weighted mean over what is drawn is the mean over all candidates."""
    importance = Importance(uniform_share=0.25, weighted=True)
    density = importance.probabilities(VALUES)
    weights = importance.weights(density)
    quantity = torch.tensor([3.0, -1.0, 4.0, 1.0], dtype=torch.float64)
    assert (density * weights * quantity).sum().item() == pytest.approx(quantity.mean().item())
    assert weights.max().item() == pytest.approx(1 / 0.25)  # where the value is 0


@pytest.mark.parametrize(("share", "count"), [(0.5, 16), (0.1, 16), (0.1, 64), (0.2, 1)])
def test_the_weighted_mean_of_draws_is_that_of_all_candidates(share: float, count: int) -> None:
    """Of the rare ones, which most draws are of, and of the others.

    Independent draws would have a variance of (Σ 1 / (m² p_i) - (Σ 1 / m)²) / count.
    """
    values = torch.ones(512)
    values[:16] = 100.0
    importance = Importance(uniform_share=share, weighted=True)
    generator = torch.Generator().manual_seed(3)
    rare, common = [], []
    for _ in range(2000):
        drawn, weights = importance.draw(values, count, generator)
        rare.append((weights * (drawn < 16)).sum().item() / count)
        common.append((weights * (drawn >= 16)).sum().item() / count)
    density = importance.probabilities(values).numpy()
    for found, p in ((rare, density[:16]), (common, density[16:])):
        expected = len(p) / 512
        independent = ((1 / (512**2 * p)).sum() - expected**2) / count
        variance = np.var(found, ddof=1)
        assert abs(np.mean(found) - expected) < 4 * (variance / len(found)) ** 0.5
        assert variance < 3 * independent


def test_uniform_draws_all_count_the_same() -> None:
    importance = Importance(uniform_share=0.2, weighted=True)
    _, weights = importance.draw(torch.ones(50), 8, torch.Generator().manual_seed(0))
    assert weights.tolist() == pytest.approx([1] * 8)


def test_where_all_are_drawn_all_count_the_same() -> None:
    importance = Importance(uniform_share=0.2, weighted=True)
    _, weights = importance.draw(VALUES, 4, torch.Generator().manual_seed(0))
    assert weights.tolist() == [1, 1, 1, 1]


def test_without_weights_all_count_the_same() -> None:
    _, weights = Importance(uniform_share=0.5).draw(VALUES, 3, torch.Generator().manual_seed(0))
    assert weights.tolist() == [1, 1, 1]


def test_single_draws_follow_the_density() -> None:
    importance = Importance(uniform_share=0.2)
    generator = torch.Generator().manual_seed(1)
    drawn = [importance.draw(VALUES, 1, generator)[0].item() for _ in range(4000)]
    expected = 4000 * importance.probabilities(VALUES).numpy()
    assert stats.chisquare(np.bincount(drawn, minlength=4), expected).pvalue > 1e-3


def test_several_draws_are_different_candidates_and_follow_successive_sampling() -> None:
    """The second of two: sum over first ones of p_i p_j / (1 - p_i)."""
    importance = Importance(uniform_share=0.2)
    generator = torch.Generator().manual_seed(2)
    pairs = [importance.draw(VALUES, 2, generator)[0].tolist() for _ in range(4000)]
    assert all(first != second for first, second in pairs)
    p = importance.probabilities(VALUES).numpy()
    second = np.array([sum(p[i] * p[j] / (1 - p[i]) for i in range(4) if i != j) for j in range(4)])
    counts = np.bincount([second for _, second in pairs], minlength=4)
    assert stats.chisquare(counts, 4000 * second).pvalue > 1e-3


def test_candidates_without_value_are_drawn_when_nothing_else_is_left() -> None:
    drawn, _ = Importance(uniform_share=0.0).draw(VALUES, 4, torch.Generator().manual_seed(0))
    assert sorted(drawn.tolist()) == [0, 1, 2, 3]
    assert drawn[-1] == 0


@pytest.mark.parametrize("values", [[0.0, 0.0], [float("nan"), float("inf")]])
def test_without_any_value_the_density_is_uniform(values: list[float]) -> None:
    found = Importance(uniform_share=0.0).probabilities(torch.tensor(values))
    assert found.tolist() == [0.5, 0.5]


def test_tiny_and_huge_values_keep_their_proportion() -> None:
    values = torch.tensor([1e-30, 3e-30])
    assert Importance(uniform_share=0.0, power=3.0).probabilities(values).tolist() == pytest.approx(
        [1 / 28, 27 / 28]
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"uniform_share": -0.1}, "uniform_share: -0.1"),
        ({"uniform_share": 1.5}, "uniform_share: 1.5"),
        ({"uniform_share": float("nan")}, "uniform_share: nan"),
        ({"uniform_share": 0.5, "power": 0.0}, "power: 0.0"),
        ({"uniform_share": 0.5, "largest_ratio": 0.9}, "largest_ratio: 0.9"),
        ({"uniform_share": 0.5, "largest_ratio": float("nan")}, "largest_ratio: nan"),
        ({"uniform_share": 0.0, "weighted": True}, "unbounded"),
    ],
)
def test_numbers_out_of_range_are_refused(arguments: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        Importance(**arguments)


def test_more_draws_than_candidates_and_negative_values_are_refused() -> None:
    importance = Importance(uniform_share=0.5)
    with pytest.raises(ValueError, match="only 4 candidates"):
        importance.draw(VALUES, 5, torch.Generator())
    with pytest.raises(ValueError, match="-1"):
        importance.probabilities(torch.tensor([1.0, -1.0]))
