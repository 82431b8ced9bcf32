"""Every sampler the parts can be combined to, and the distributions they end in."""

import math
from itertools import product

import pytest
import torch
from scipy import stats

from ngi.explore import (
    Always,
    ConstantTarget,
    ExponentialPerturbation,
    Greedy,
    LatinHypercube,
    Loss,
    LossTimesOutputGradient,
    LossTimesStep,
    MarkovChains,
    Metropolis,
    NormalPerturbation,
    Signals,
    Sobol,
    SobolQuarters,
)

PROPOSALS = [
    NormalPerturbation(large_step_probability=0.3, standard_deviation=0.045),
    NormalPerturbation(large_step_probability=1, standard_deviation=0.045),
    ExponentialPerturbation(large_step_probability=0.3, smallest=1 / 25, largest=1 / 20),
    Sobol(seed=1),
    LatinHypercube(),
]
TARGETS = [Loss(), LossTimesStep(), LossTimesOutputGradient(), ConstantTarget()]
ACCEPTANCES = [Greedy(accept_equal=False), Greedy(accept_equal=True), Metropolis(), Always()]


def signals(position):
    """Smooth signals that depend on the position alone; 0 somewhere."""
    loss = (2 * math.pi * position[:, 0]).sin().clamp_min(0)
    return Signals(
        loss=loss, output_gradient_norm=1 + position[:, 1], step_norm=2 - position[:, -1]
    )


def explore(sampler, *, dimensions, steps, seed):
    generator = torch.Generator().manual_seed(seed)
    state, infos, next_id = sampler.init(dimensions), [], 0
    for batch in range(steps):
        proposals = sampler.propose(state, generator, batch=batch)
        ids = torch.arange(next_id, next_id + sampler.chains)
        next_id += sampler.chains
        current = sampler.target(signals(state.position))
        state, info = sampler.accept(
            state, proposals, ids, current, sampler.target(signals(proposals.position)), generator
        )
        infos.append(info)
    return state, infos


@pytest.mark.parametrize(
    ("proposal", "target", "acceptance"),
    list(product(PROPOSALS, TARGETS, ACCEPTANCES)),
    ids=lambda part: type(part).__name__,
)
@pytest.mark.parametrize(("chains", "dimensions"), [(1, 2), (16, 11)])
def test_every_sampler_keeps_the_protocol(proposal, target, acceptance, chains, dimensions) -> None:
    sampler = MarkovChains(chains=chains, proposal=proposal, target=target, acceptance=acceptance)
    assert target.requires <= {"loss", "output_gradient_norm", "step_norm"}
    state, infos = explore(sampler, dimensions=dimensions, steps=20, seed=1)
    assert state.occupied.all()
    assert state.position.shape == (chains, dimensions)
    assert ((state.position >= 0) & (state.position <= 1)).all()
    assert state.patch.unique().numel() == chains
    # A chain holds the patch of the step in which it last accepted.
    assert torch.equal(state.patch // chains, 19 - state.age)
    assert infos[0].accepted.all()
    assert all(0 <= info.acceptance_rate <= 1 for info in infos[1:])
    again, _ = explore(sampler, dimensions=dimensions, steps=20, seed=1)
    for name, tensor in state.state_dict().items():
        assert torch.equal(tensor, again.state_dict()[name])


def final_histogram(acceptance, density, *, chains=8_000, steps=150):
    """Counts over 6 x 6 cells of where independent chains stand in the end."""
    sampler = MarkovChains(
        chains=chains,
        proposal=NormalPerturbation(large_step_probability=0.3, standard_deviation=0.1),
        target=Loss(),
        acceptance=acceptance,
    )
    generator = torch.Generator().manual_seed(5)
    state = sampler.init(2)
    for batch in range(steps):
        proposals = sampler.propose(state, generator, batch=batch)
        state, _ = sampler.accept(
            state,
            proposals,
            torch.arange(chains),
            density(state.position),
            density(proposals.position),
            generator,
        )
    cells = (state.position * 6).long().clamp_max(5)
    return torch.bincount(cells[:, 0] * 6 + cells[:, 1], minlength=36).numpy()


def density(position):
    """p(x, y) = x^2 (1 + 0.8 sin(2 pi y)), unnormalised: a jump in x at the border, 0 at x = 0."""
    return position[:, 0] ** 2 * (1 + 0.8 * (2 * math.pi * position[:, 1]).sin())


def expected_histogram(chains=8_000):
    edges = torch.linspace(0, 1, 7, dtype=torch.float64)
    x = (edges**3).diff()
    y = (edges - 0.8 * (2 * math.pi * edges).cos() / (2 * math.pi)).diff()
    return (chains * x[:, None] * y[None, :]).flatten().numpy()


def chi_square(counts, expected):
    """p-value, cells of less than 5 expected counts taken together."""
    rare = expected < 5
    return stats.chisquare(
        [*counts[~rare], counts[rare].sum()], [*expected[~rare], expected[rare].sum()]
    ).pvalue


def test_metropolis_converges_to_the_target_distribution() -> None:
    assert chi_square(final_histogram(Metropolis(), density), expected_histogram()) > 1e-3


@pytest.mark.parametrize("acceptance", [Always(), Greedy(accept_equal=False)])
def test_other_rules_do_not_converge_to_the_target_distribution(acceptance) -> None:
    counts = final_histogram(acceptance, density, steps=60)
    assert chi_square(counts, expected_histogram()) < 1e-9


def test_always_converges_to_the_uniform_distribution() -> None:
    counts = final_histogram(Always(), density, steps=10)
    assert stats.chisquare(counts).pvalue > 1e-3


def test_greedy_climbs_to_the_maximum() -> None:
    counts = final_histogram(Greedy(accept_equal=False), density, steps=60).reshape(6, 6)
    assert counts[5, :3].sum() > 0.95 * counts.sum()


@pytest.mark.parametrize("proposal", [*PROPOSALS, SobolQuarters(seed=1)])
def test_a_sampler_says_how_many_patches_it_draws_of_one_scene_vector(proposal) -> None:
    sampler = MarkovChains(
        chains=16, proposal=proposal, target=ConstantTarget(), acceptance=Always()
    )
    proposed = sampler.propose(sampler.init(5), torch.Generator(), batch=3).position
    _, patches = proposed[:, :-2].unique_consecutive(dim=0, return_counts=True)
    assert set(patches.tolist()) == {sampler.patches_per_vector}
