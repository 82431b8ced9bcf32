import pytest
import torch
from scipy import stats

from ngi.explore import Always, Greedy, Metropolis


def accept(rule, proposed, current, seed=0):
    return rule(
        torch.as_tensor(proposed, dtype=torch.float64),
        torch.as_tensor(current, dtype=torch.float64),
        torch.Generator().manual_seed(seed),
    )


def test_greedy_accepts_improvements_only() -> None:
    proposed, current = [2.0, 1.0, 0.5, 0.0, 1e-30], [1.0, 1.0, 1.0, 0.0, 0.0]
    paper = accept(Greedy(accept_equal=False), proposed, current)
    release = accept(Greedy(accept_equal=True), proposed, current)
    assert paper.tolist() == [True, False, False, False, True]
    assert release.tolist() == [True, True, False, True, True]


def test_always_accepts_and_needs_no_current_targets() -> None:
    assert accept(Always(), [0.0, 1.0], [5.0, 0.0]).all()
    assert not Always().needs_current
    assert Metropolis().needs_current
    assert Greedy(accept_equal=True).needs_current


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.5, 0.99, 1.0, 3.0])
def test_metropolis_accepts_with_the_ratio_of_the_targets(ratio) -> None:
    n = 20_000
    accepted = accept(Metropolis(), torch.full((n,), 7e-12 * ratio), torch.full((n,), 7e-12))
    expected = min(1.0, ratio)
    assert stats.binomtest(int(accepted.sum()), n, expected).pvalue > 1e-3
    if 0 < ratio < 1:
        assert stats.binomtest(int(accepted.sum()), n, expected**1.2).pvalue < 0.02


def test_metropolis_leaves_a_state_of_target_zero() -> None:
    assert accept(Metropolis(), [0.0, 1.0, 1e-300], [0.0, 0.0, 0.0]).all()
    assert not accept(Metropolis(), torch.zeros(10_000), torch.full((10_000,), 1e-30)).any()


def test_metropolis_draws_one_number_per_chain() -> None:
    accepted = accept(Metropolis(), torch.full((1000,), 0.5), torch.ones(1000))
    assert accepted.any()
    assert not accepted.all()
    assert torch.equal(accepted, accept(Metropolis(), torch.full((1000,), 0.5), torch.ones(1000)))


@pytest.mark.parametrize(("proposed", "current"), [([-1.0], [1.0]), ([1.0], [-1.0])])
def test_metropolis_rejects_negative_targets(proposed, current) -> None:
    with pytest.raises(ValueError, match="negative"):
        accept(Metropolis(), proposed, current)
