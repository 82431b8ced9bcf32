import io
import math
from dataclasses import dataclass

import pytest
import torch
from torch import Tensor

from ngi.explore import (
    Always,
    ChainState,
    ConstantTarget,
    Greedy,
    Loss,
    MarkovChains,
    Metropolis,
    Proposals,
)

NAN, INF = float("nan"), float("inf")


@dataclass
class FixedProposal:
    """Proposes what it is told to."""

    position: torch.Tensor
    large_step: torch.Tensor
    starts_chains: bool = False
    weight: torch.Tensor | None = None

    def propose(self, position, generator, *, batch):  # noqa: ARG002
        assert position.shape == self.position.shape
        return Proposals(position=self.position, large_step=self.large_step, weight=self.weight)


@dataclass
class FixedAcceptance:
    """Accepts what it is told to and remembers the targets it was shown."""

    answer: torch.Tensor
    needs_current: bool = True

    def __call__(self, target_proposed, target_current, generator):  # noqa: ARG002
        self.seen = (target_proposed.tolist(), target_current.tolist())
        return self.answer


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def sampler(acceptance, n=3, proposal=None):
    proposal = proposal or FixedProposal(torch.full((n, 4), 0.75), torch.zeros(n, dtype=torch.bool))
    return MarkovChains(chains=n, proposal=proposal, target=Loss(), acceptance=acceptance)


def standing(n=3):
    return ChainState(
        position=torch.full((n, 4), 0.25), patch=torch.arange(n), age=torch.arange(n) + 5
    )


def test_chains_start_without_a_state() -> None:
    state = sampler(Always(), n=5).init(4)
    assert state.position.shape == (5, 4)
    assert not state.occupied.any()
    assert state.patch.dtype == state.age.dtype == torch.int64


def test_a_chain_without_a_state_makes_a_large_step() -> None:
    chains = sampler(Always())
    state = ChainState(
        position=torch.zeros(3, 4), patch=torch.tensor([-1, 7, -1]), age=torch.zeros(3)
    )
    proposals = chains.propose(state, generator(), batch=0)
    assert proposals.large_step.tolist() == [True, False, True]
    assert (proposals.position[1] == 0.75).all()
    assert (proposals.position[[0, 2]] != 0.75).all()
    assert not torch.equal(proposals.position[0], proposals.position[2])
    assert ((proposals.position >= 0) & (proposals.position < 1)).all()


def test_weights_of_proposals_are_kept_and_a_drawn_state_has_none() -> None:
    none, weight = torch.zeros(3, dtype=torch.bool), torch.tensor([0.5, 2.0, 4.0])
    proposal = FixedProposal(torch.full((3, 4), 0.75), none, weight=weight)
    state = ChainState(
        position=torch.zeros(3, 4), patch=torch.tensor([-1, 7, 3]), age=torch.zeros(3)
    )
    chains = sampler(Always(), proposal=proposal)
    assert chains.propose(state, generator(), batch=0).weight.tolist() == [1, 2, 4]


def test_accept_moves_the_chains_the_rule_chooses() -> None:
    rule = FixedAcceptance(torch.tensor([True, False, True]))
    chains, state = sampler(rule), standing()
    proposals = chains.propose(state, generator(), batch=0)
    current, proposed = torch.tensor([1.0, 2.0, 3.0]), torch.tensor([4.0, 5.0, 6.0])
    moved, info = chains.accept(
        state, proposals, torch.tensor([10, 11, 12]), current, proposed, generator()
    )
    assert rule.seen == ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])
    assert moved.position[:, 0].tolist() == [0.75, 0.25, 0.75]
    assert moved.patch.tolist() == [10, 1, 12]
    assert moved.age.tolist() == [0, 7, 0]
    assert state.patch.tolist() == [0, 1, 2]
    assert info.acceptance_rate == pytest.approx(2 / 3)
    assert info.mean_age == pytest.approx(7 / 3)


def test_info_tells_large_from_small_steps_and_leaves_out_first_states() -> None:
    proposal = FixedProposal(torch.full((4, 4), 0.75), torch.tensor([True, True, False, False]))
    chains = sampler(FixedAcceptance(torch.tensor([True, False, False, False])), 4, proposal)
    state = ChainState(
        position=torch.zeros(4, 4), patch=torch.tensor([0, 1, 2, -1]), age=torch.zeros(4)
    )
    ones = torch.ones(4)
    _, info = chains.accept(
        state, chains.propose(state, generator(), batch=0), torch.arange(4), ones, ones, generator()
    )
    assert info.accepted.tolist() == [True, False, False, True]
    assert info.acceptance_rate == pytest.approx(1 / 3)
    assert info.large_step_acceptance_rate == 0.5
    assert info.small_step_acceptance_rate == 0
    assert info.initialised.tolist() == [False, False, False, True]


def test_rates_of_nothing_are_nan() -> None:
    chains = sampler(Always())
    state = chains.init(4)
    ones = torch.ones(3)
    _, info = chains.accept(
        state, chains.propose(state, generator(), batch=0), torch.arange(3), ones, ones, generator()
    )
    assert info.accepted.all()
    assert math.isnan(info.acceptance_rate)
    assert math.isnan(info.small_step_acceptance_rate)


@pytest.mark.parametrize("current", [0.0, 5.0, NAN, INF])
@pytest.mark.parametrize(
    "rule", [Greedy(accept_equal=False), Greedy(accept_equal=True), Metropolis(), Always()]
)
def test_a_chain_without_a_state_accepts_whatever_stands_for_its_target(rule, current) -> None:
    chains = sampler(rule)
    state = chains.init(4)
    moved, _ = chains.accept(
        state,
        chains.propose(state, generator(), batch=0),
        torch.arange(3),
        torch.full((3,), current),
        torch.tensor([0.0, 1.0, 2.0]),
        generator(),
    )
    assert moved.occupied.all()


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize(
    "rule", [Greedy(accept_equal=False), Greedy(accept_equal=True), Metropolis(), Always()]
)
def test_non_finite_targets_neither_win_nor_block(rule, bad) -> None:
    chains = sampler(rule, n=5)
    state = standing(5)
    state.patch[4] = -1
    moved, info = chains.accept(
        state,
        chains.propose(state, generator(), batch=0),
        torch.arange(5) + 10,
        torch.tensor([0.0, bad, bad, bad, 0.0]),
        torch.tensor([bad, bad, 0.0, 1.0, bad]),
        generator(),
    )
    assert info.accepted.tolist() == [False, False, True, True, False]
    assert moved.occupied.tolist() == [True, True, True, True, False]


def test_only_a_rule_that_looks_needs_the_current_targets() -> None:
    uniform = MarkovChains(
        chains=3, proposal=sampler(Always()).proposal, target=ConstantTarget(), acceptance=Always()
    )
    assert not uniform.needs_current
    state = standing()
    proposals, ids, ones = (
        uniform.propose(state, generator(), batch=0),
        torch.arange(3),
        torch.ones(3),
    )

    def moved(chains: MarkovChains, current: float) -> Tensor:
        targets = torch.full((3,), current)
        return chains.accept(state, proposals, ids, targets, ones, generator())[0].position

    assert torch.equal(moved(uniform, 0.0), moved(uniform, 1e6))
    greedy = sampler(Greedy(accept_equal=False))
    assert greedy.needs_current
    assert not torch.equal(moved(greedy, 0.0), moved(greedy, 1e6))


def test_targets_may_need_gradients_and_be_half_precision() -> None:
    chains, state = sampler(Greedy(accept_equal=False)), standing()
    proposed = torch.ones(3, dtype=torch.bfloat16, requires_grad=True)
    moved, _ = chains.accept(
        state,
        chains.propose(state, generator(), batch=0),
        torch.arange(3),
        torch.zeros(3),
        proposed * 2,
        generator(),
    )
    assert (moved.position == 0.75).all()


def test_state_survives_a_checkpoint() -> None:
    state = standing()
    file = io.BytesIO()
    torch.save(state.state_dict(), file)
    file.seek(0)
    restored = ChainState.from_state_dict(torch.load(file, weights_only=True))
    for name, tensor in state.state_dict().items():
        assert torch.equal(getattr(restored, name), tensor)
        assert getattr(restored, name).dtype == tensor.dtype


def test_bad_input_is_named() -> None:
    chains, state = sampler(Greedy(accept_equal=False)), standing()
    proposals = chains.propose(state, generator(), batch=0)
    ids, ones = torch.arange(3), torch.ones(3)
    with pytest.raises(ValueError, match="target_proposed: shape"):
        chains.accept(state, proposals, ids, ones, torch.ones(2), generator())
    with pytest.raises(ValueError, match="target_current: shape"):
        chains.accept(state, proposals, ids, torch.ones(3, 1), ones, generator())
    with pytest.raises(ValueError, match="patch_ids"):
        chains.accept(state, proposals, ids - 1, ones, ones, generator())
    with pytest.raises(ValueError, match="chains: 0"):
        sampler(Always(), n=0)
    with pytest.raises(ValueError, match="state_dimensions: 1"):
        chains.init(1)
    with pytest.raises(ValueError, match="checkpoint of the chains"):
        ChainState.from_state_dict({"position": ones})
