"""The sampler that looks at states before they are rendered."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
import torch

from ngi.explore import Importance, PredictedFromBuffers
from ngi.explore.predicted import PredictedState
from ngi.explore.space_filling import SobolSequence

CHAINS = 4


def looking(**changes: object) -> PredictedFromBuffers:
    arguments: dict[str, object] = {
        "seed": 1,
        "chains": CHAINS,
        "candidates": 64,
        "importance": Importance(uniform_share=0.0, power=4.0),
        "memory": 256,
        "uniform_first": 2 * CHAINS,
        "trees": 8,
        "depth": 4,
        "smallest_leaf": 2,
    }
    return PredictedFromBuffers(**{**arguments, **changes})  # type: ignore[arg-type]


def begun(found: PredictedFromBuffers, dimensions: int) -> PredictedState:
    """Of one that begins to look, and predicts the same everywhere."""
    nothing = torch.zeros(2 * CHAINS, 1)
    return replace(found.init(dimensions), seen=nothing, loss=nothing[:, 0])


def wave(states: torch.Tensor) -> torch.Tensor:
    """0 or 1 at so many places that no forest finds them by the states."""
    return ((states.double().sum(dim=1) * 1e4 * math.e) % 1 < 0.2).float()


def found_by(told: Callable[[torch.Tensor], torch.Tensor], *, falling: float = 1.0) -> float:
    """The share of `wave`'s places among the states of a run, from its 31st batch on.

    told: what is known of states [m, F]; falling: by which losses change from batch to batch
    """
    found, generator = looking(), torch.Generator().manual_seed(5)
    state, shares = found.init(4), []
    for batch in range(120):
        proposals = found.propose(state, generator, batch=batch, describe=told)
        lost = wave(proposals.position)
        shares.append(lost.mean().item())
        losses = (0.1 + lost) * falling**batch
        ids, zeros = torch.arange(CHAINS), torch.zeros(CHAINS)
        state, _ = found.accept(state, proposals, ids, zeros, zeros, generator, losses=losses)
    return sum(shares[30:]) / len(shares[30:])


def telling(states: torch.Tensor) -> torch.Tensor:
    return torch.stack([wave(states), torch.ones(len(states))], dim=1)


def test_what_is_known_finds_what_states_do_not_tell() -> None:
    assert found_by(telling) > 0.5
    assert found_by(lambda states: torch.ones(len(states), 2)) < 0.3


def test_losses_of_a_network_that_learns_fast_count_among_those_of_their_batch() -> None:
    """To three tenths from batch to batch: without it less than 0.7 of them are found."""
    assert found_by(telling, falling=0.3) > 0.85


def test_of_equal_predictions_the_less_settled_come_first() -> None:
    def unsettled(states: torch.Tensor) -> torch.Tensor:
        return torch.stack([torch.zeros(len(states)), 0.1 + 4.5 * wave(states)], dim=1)

    found, generator = looking(), torch.Generator().manual_seed(6)
    state = begun(found, 4)
    chosen = torch.cat(
        [found.propose(state, generator, batch=0, describe=unsettled).position for _ in range(50)]
    )
    assert wave(chosen).mean() > 0.8


def looks(
    found: PredictedFromBuffers, *, batches: Sequence[int], dimensions: int, lost: float = 0.0
) -> list[torch.Tensor]:
    """The states that are described in these batches of a run, which chooses any of them.

    lost: on the first patch of each of the first two batches
    """
    asked: list[torch.Tensor] = []

    def describe(states: torch.Tensor) -> torch.Tensor:
        asked.append(states.clone())
        return torch.ones(len(states), 1)

    generator, state = torch.Generator().manual_seed(8), found.init(dimensions)
    for batch in batches:
        proposals = found.propose(state, generator, batch=batch, describe=describe)
        ids, zeros, losses = torch.arange(CHAINS), torch.zeros(CHAINS), torch.zeros(CHAINS)
        if batch in batches[:2]:
            losses[0] = lost
        state, _ = found.accept(state, proposals, ids, zeros, zeros, generator, losses=losses)
        assert all((asked[-1] == chosen).all(dim=1).any() for chosen in proposals.position)
        assert len(proposals.position[:, :-2].unique(dim=0)) == CHAINS
    return asked


def test_candidates_are_four_patches_each_of_a_few_images() -> None:
    groups = looks(looking(), batches=range(3), dimensions=5)[-1].unflatten(0, (16, 4))
    assert (groups[:, :, :-2] == groups[:, :1, :-2]).all()
    assert len(groups[:, 0, :-2].unique(dim=0)) == 16
    assert len(groups[..., -2:].flatten(0, 1).unique(dim=0)) == 64
    quarters = (groups[:, :, -2:] >= 0.5).long() @ torch.tensor([1, 2])
    assert all(sorted(group) == [0, 1, 2, 3] for group in quarters.tolist())
    within = groups[..., -2:] % 0.5
    torch.testing.assert_close(within, within[:, :1].expand(-1, 4, -1))


def test_what_is_looked_at_goes_through_one_sequence() -> None:
    """So does what is not chosen yet: equal intervals of a variable hold as many points each."""
    first, *others = looks(looking(uniform_first=32), batches=range(38), dimensions=5)
    asked = torch.cat([first, *others[:7], *[group[::4] for group in others[7:]]])
    assert torch.equal(asked, SobolSequence(seed=1).points(0, 32 + 30 * 16, 5))
    for width in (16, 64, 512):
        for column in asked.T:
            assert ((column[:512] * width).long().bincount(minlength=width) == 512 // width).all()


def test_nothing_is_looked_at_twice_where_batches_are_refused_and_losses_are_not_finite() -> None:
    batches = [0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 14, 15]
    asked = looks(looking(uniform_first=32), batches=batches, dimensions=5, lost=math.nan)
    assert [len(states) for states in asked] == [CHAINS] * 9 + [64] * 4
    assert len(torch.cat(asked).unique(dim=0)) == 9 * CHAINS + 4 * 64


def test_a_sampler_that_looks_needs_somebody_who_tells() -> None:
    found = looking()
    assert found.needs_description
    with pytest.raises(RuntimeError, match="64 states are to be described"):
        found.propose(begun(found, 5), torch.Generator(), batch=0)


def test_before_a_network_knows_anything_states_are_uniform() -> None:
    """Whatever is told of them, which is remembered for later: of these alone, and all at once."""
    found, generator = looking(uniform_first=40), torch.Generator().manual_seed(3)
    state, chosen, asked, flat = found.init(4), [], [], []

    def describe(states: torch.Tensor) -> torch.Tensor:
        asked.append(len(states))
        return telling(states)

    ids, zeros = torch.arange(CHAINS), torch.zeros(CHAINS)
    for batch in range(20):
        flat.append(bool(state.threshold.isinf().all()))
        proposals = found.propose(state, generator, batch=batch, describe=describe)
        lost = wave(proposals.position)
        chosen.append(lost.mean().item())
        state, _ = found.accept(state, proposals, ids, zeros, zeros, generator, losses=0.1 + lost)
    assert asked == [CHAINS] * 10 + [64] * 10
    assert flat == [True] * 10 + [False] * 10
    assert sum(chosen[:10]) / 10 == pytest.approx(0.2, abs=0.13)
    assert sum(chosen[10:]) / 10 > 0.8


@pytest.mark.parametrize("uniform_first", [2 * CHAINS - 1, 257])
def test_a_beginning_that_is_too_short_or_forgotten_is_refused(uniform_first: int) -> None:
    named = (
        rf"sampler\.uniform_first: {uniform_first}: give at least 8, .*sampler.memory, which is 256"
    )
    with pytest.raises(ValueError, match=named):
        looking(uniform_first=uniform_first)


@pytest.mark.parametrize("candidates", [12, 62])
def test_candidates_that_are_no_groups_are_refused(candidates: int) -> None:
    named = rf"sampler\.candidates: {candidates}: give a multiple of 4 and at least 16"
    with pytest.raises(ValueError, match=named):
        looking(candidates=candidates)


def test_weights_that_nobody_knows_are_refused() -> None:
    with pytest.raises(ValueError, match=r"sampler\.importance\.weighted"):
        looking(importance=Importance(uniform_share=0.5, weighted=True))


def test_of_patches_of_one_image_the_better_are_drawn() -> None:
    """In proportion to the power, and each by itself as likely as its share says."""

    def describe(states: torch.Tensor) -> torch.Tensor:
        return torch.tensor([1.0, 2.0, 3.0, 4.0]).repeat(len(states) // 4)[:, None]

    found = looking(candidates=4 * CHAINS, importance=Importance(uniform_share=0.0, power=2.0))
    state, generator = begun(found, 3), torch.Generator().manual_seed(7)
    known = [found.propose(state, generator, batch=0, describe=describe).known for _ in range(1000)]
    drawn = torch.cat([each for each in known if each is not None]).flatten().long()
    shares = drawn.bincount()[1:] / len(drawn)  # of values that are roots: 1 to 4, as they are
    assert shares.tolist() == pytest.approx([0.1, 0.2, 0.3, 0.4], abs=0.025)


def test_more_dimensions_than_there_are_sequences_for_are_refused_at_the_start() -> None:
    with pytest.raises(ValueError, match=r"exist for at most 21201; choose"):
        looking().init(21_202)
