import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from ngi.explore import ExponentialPerturbation, NormalPerturbation
from ngi.explore.proposals import wrap

SIGNIFICANCE = 1e-3

NORMAL = NormalPerturbation(large_step_probability=0, standard_deviation=0.045)
EXPONENTIAL = ExponentialPerturbation(large_step_probability=0, smallest=1 / 25, largest=1 / 20)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def displacement(proposal, start, n=20_000, seed=0):
    """Signed shortest way round the torus, of n one-dimensional chains at `start`."""
    position = torch.full((n, 1), start)
    moved = proposal.propose(position, generator(seed), batch=0).position.double() - start
    return ((moved + 0.5) % 1 - 0.5).flatten().numpy()


def test_large_steps_are_uniform_in_every_component() -> None:
    proposal = NormalPerturbation(large_step_probability=1, standard_deviation=0.045)
    proposals = proposal.propose(torch.full((20_000, 3), 0.3), generator(), batch=0)
    assert proposals.large_step.all()
    for component in proposals.position.T:
        assert stats.kstest(component.numpy(), "uniform").pvalue > SIGNIFICANCE
    correlation = torch.corrcoef(proposals.position.T)
    assert (correlation - torch.eye(3)).abs().max() < 4 / 20_000**0.5


@pytest.mark.parametrize("proposal", [NORMAL, EXPONENTIAL])
def test_every_component_takes_small_steps_of_its_own(proposal) -> None:
    n, dimensions = 20_000, 5
    position = torch.full((n, dimensions), 0.5)
    moved = proposal.propose(position, generator(), batch=0).position - 0.5
    alone = displacement(proposal, 0.5, seed=1)
    for component in moved.T:
        assert stats.ks_2samp(component.numpy(), alone).pvalue > SIGNIFICANCE
    for of in (moved, moved.abs()):
        assert (torch.corrcoef(of.T) - torch.eye(dimensions)).abs().max() < 5 / n**0.5


def test_small_steps_are_not_uniform() -> None:
    proposals = NORMAL.propose(torch.full((20_000, 1), 0.3), generator(), batch=0)
    assert stats.kstest(proposals.position.flatten().numpy(), "uniform").pvalue < 1e-9


def test_normal_perturbation_is_normal() -> None:
    moved = displacement(NORMAL, 0.5)
    assert stats.kstest(moved, stats.norm(0, 0.045).cdf).pvalue > SIGNIFICANCE
    assert stats.kstest(moved, stats.norm(0, 0.05).cdf).pvalue < 1e-9


def test_exponential_perturbation_is_that_of_kelemen() -> None:
    moved = displacement(EXPONENTIAL, 0.5)
    size = abs(moved)
    assert stats.kstest(size, stats.loguniform(1 / 25, 1 / 20).cdf).pvalue > SIGNIFICANCE
    assert stats.kstest(size, stats.uniform(1 / 25, 1 / 100).cdf).pvalue < 1e-9
    assert stats.binomtest(int((moved > 0).sum()), len(moved)).pvalue > SIGNIFICANCE


def test_both_perturbations_have_steps_of_the_same_size() -> None:
    normal, exponential = displacement(NORMAL, 0.5), displacement(EXPONENTIAL, 0.5)
    assert (normal**2).mean() ** 0.5 == pytest.approx((exponential**2).mean() ** 0.5, rel=0.03)


@pytest.mark.parametrize("proposal", [NORMAL, EXPONENTIAL])
@pytest.mark.parametrize("start", [0.0, 0.01, 0.99])
def test_small_steps_are_symmetric_across_the_border(proposal, start) -> None:
    inside = displacement(proposal, 0.5, seed=1)
    border = displacement(proposal, start, seed=2)
    assert stats.ks_2samp(inside, border).pvalue > SIGNIFICANCE
    assert stats.ks_2samp(border, -border).pvalue > SIGNIFICANCE


def test_clamped_steps_would_not_be_symmetric() -> None:
    inside = displacement(NORMAL, 0.5, seed=1)
    clamped = (0.01 + displacement(NORMAL, 0.5, seed=2)).clip(0, 1) - 0.01
    assert stats.ks_2samp(inside, clamped).pvalue < 1e-9


@settings(deadline=None, derandomize=True)
@given(
    st.lists(st.floats(-8, 8, width=32), min_size=1),
    st.sampled_from([torch.float32, torch.float64]),
)
def test_wrap_ends_in_the_half_open_interval(values, dtype) -> None:
    position = torch.tensor(values, dtype=dtype)
    wrapped = wrap(position)
    assert (wrapped >= 0).all()
    assert (wrapped < 1).all()
    distance = (wrapped.double() - position.double() + 0.5) % 1 - 0.5
    assert distance.abs().max() < 1e-6


@pytest.mark.parametrize("value", [-1e-10, -1e-38, -0.0, 0.0, 1.0, 2.0, -1.0])
def test_wrap_takes_what_rounds_to_one_to_zero(value) -> None:
    assert wrap(torch.tensor([value])).item() == 0


@pytest.mark.parametrize("cls", [NormalPerturbation, ExponentialPerturbation])
@pytest.mark.parametrize("probability", [0.0, 0.3, 1.0])
def test_large_steps_come_with_their_probability(cls, probability) -> None:
    sizes = (
        {"standard_deviation": 0.045}
        if cls is NormalPerturbation
        else {"smallest": 1 / 25, "largest": 1 / 20}
    )
    proposal = cls(large_step_probability=probability, **sizes)
    position = torch.full((20_000, 2), 0.5)
    proposals = proposal.propose(position, generator(), batch=0)
    large = int(proposals.large_step.sum())
    assert stats.binomtest(large, 20_000, probability).pvalue > SIGNIFICANCE
    far = ((proposals.position - position).abs() > 0.3).any(1)
    assert not (far & ~proposals.large_step).any()
    assert proposals.position.dtype == torch.float32


@pytest.mark.parametrize("proposal", [NORMAL, EXPONENTIAL])
def test_the_generator_alone_decides(proposal) -> None:
    position = torch.full((16, 4), 0.5)
    before = torch.get_rng_state()
    first = proposal.propose(position, generator(3), batch=0)
    assert torch.equal(torch.get_rng_state(), before)
    again = proposal.propose(position, generator(3), batch=0)
    other = proposal.propose(position, generator(4), batch=0)
    assert torch.equal(first.position, again.position)
    assert not torch.equal(first.position, other.position)
    assert (position == 0.5).all()


@pytest.mark.parametrize("deviation", [0, -0.1, float("nan"), float("inf")])
def test_normal_perturbation_rejects_impossible_deviations(deviation) -> None:
    with pytest.raises(ValueError, match="standard_deviation"):
        NormalPerturbation(large_step_probability=0.3, standard_deviation=deviation)


@pytest.mark.parametrize(("smallest", "largest"), [(0, 0.1), (0.2, 0.1), (0.1, 0.6)])
def test_exponential_perturbation_rejects_impossible_sizes(smallest, largest) -> None:
    with pytest.raises(ValueError, match="smallest"):
        ExponentialPerturbation(large_step_probability=0.3, smallest=smallest, largest=largest)


@pytest.mark.parametrize("probability", [-0.1, 1.1, float("nan")])
def test_impossible_large_step_probabilities_are_rejected(probability) -> None:
    with pytest.raises(ValueError, match="large_step_probability"):
        NormalPerturbation(large_step_probability=probability, standard_deviation=0.1)
    with pytest.raises(ValueError, match="large_step_probability"):
        ExponentialPerturbation(large_step_probability=probability, smallest=0.1, largest=0.2)
