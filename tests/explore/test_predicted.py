"""The sampler that draws by a forest's predictions."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy import stats

from ngi.explore import Importance, PredictedLoss, predicted
from ngi.explore.forest import Forest
from ngi.learn import TrainingStream
from ngi.render import PocketRenderer
from ngi.reuse import Epochs
from tests.learn.comparison import assert_same
from tests.learn.small_stream import make, steps

CHAINS = 4


def sampler(**changes: object) -> PredictedLoss:
    arguments: dict[str, object] = {
        "chains": CHAINS,
        "candidates": 64,
        "importance": Importance(uniform_share=0.2, weighted=True),
        "memory": 256,
        "trees": 8,
        "depth": 5,
        "smallest_leaf": 2,
    }
    return PredictedLoss(**{**arguments, **changes})  # type: ignore[arg-type]


def test_states_are_uniform_as_long_as_hardly_any_loss_is_known() -> None:
    found = sampler()
    state = found.init(3)
    generator = torch.Generator().manual_seed(3)
    proposed = [found.propose(state, generator, batch=b) for b in range(200)]
    positions = torch.cat([p.position for p in proposed])
    for column in positions.T:
        assert stats.kstest(column.numpy(), "uniform").pvalue > 1e-3
    weights = torch.cat([p.weight for p in proposed if p.weight is not None])
    assert weights.tolist() == [1.0] * (200 * CHAINS)


def explored(
    found: PredictedLoss, *, batches: int, untrained: int = 0
) -> tuple[torch.Tensor, torch.Tensor]:
    """States proposed in the second half, and their weights; the loss is 1 in a rare box, or 0.

    untrained: batches at the start in which it is about 10 everywhere
    """
    state, generator = found.init(4), torch.Generator().manual_seed(4)
    late = []
    for batch in range(batches):
        proposals = found.propose(state, generator, batch=batch)
        losses = lit(proposals.position)
        if batch < untrained:
            losses = 5 + 10 * torch.rand(CHAINS, generator=generator)
        ids = torch.arange(CHAINS) + CHAINS * batch
        state, _ = found.accept(
            state, proposals, ids, *[torch.zeros(CHAINS)] * 2, generator, losses=losses
        )
        if batch >= batches // 2:
            late.append((proposals.position, proposals.weight))
    weights = [torch.ones(CHAINS) if w is None else w for _, w in late]
    return torch.cat([p for p, _ in late]), torch.cat(weights)


def lit(states: torch.Tensor) -> torch.Tensor:
    return ((states[:, 0] < 0.3) & (states[:, 1] > 0.7)).float()


def test_rare_losses_are_drawn_more_often_and_weigh_less() -> None:
    states, weights = explored(sampler(), batches=150)
    share = lit(states).double().mean().item()
    assert share > 3 * 0.09
    rare = lit(states).bool()
    assert weights[rare].mean() < weights[~rare].mean() / 3
    weighted = (weights * lit(states)).mean().item()
    assert weighted == pytest.approx(0.09, abs=0.04)


def test_losses_count_among_those_of_their_time() -> None:
    """Else those of the untrained network would decide for as long as they are remembered."""
    found = sampler(memory=1024, importance=Importance(uniform_share=0.2, power=4.0))
    states, _ = explored(found, batches=150, untrained=30)
    assert lit(states).mean() > 3 * 0.09


def test_losses_are_divided_by_the_mean_of_those_around_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of the first and the last 64 where there are fewer before or after them."""
    through: list[torch.Tensor] = []

    def recorded(_: torch.Tensor, losses: torch.Tensor, *__: object, **___: object) -> Forest:
        through.append(losses)
        return Forest.flat(trees=8, depth=5)

    monkeypatch.setattr(predicted, "grow", recorded)
    found, generator = sampler(), torch.Generator().manual_seed(0)
    ramp, ids, zeros = torch.arange(1.0, 201.0), torch.arange(CHAINS), torch.zeros(CHAINS)
    earlier = ramp[:-CHAINS]
    state = replace(
        found.init(3), seen=torch.zeros(len(earlier), 3), loss=earlier, newer=torch.tensor(40)
    )
    proposals = found.propose(state, generator, batch=49)
    found.accept(state, proposals, ids, zeros, zeros, generator, losses=ramp[-CHAINS:])
    means = np.convolve(ramp, np.full(64, 1 / 64), mode="valid")
    around = np.pad(means, (32, 31), mode="edge")
    np.testing.assert_allclose(through[0], ramp.numpy() / around, rtol=1e-5)


def test_without_weights_nothing_weighs() -> None:
    found = sampler(importance=Importance(uniform_share=0.5))
    proposals = found.propose(found.init(3), torch.Generator(), batch=0)
    assert proposals.weight is None
    assert not found.needs_description  # and nobody is asked what is known


def test_the_oldest_and_what_is_not_finite_are_forgotten() -> None:
    found = sampler(memory=10)
    state, generator = found.init(3), torch.Generator().manual_seed(0)
    for batch in range(5):
        proposals = found.propose(state, generator, batch=batch)
        losses = torch.tensor([batch, float("nan"), float("inf"), batch + 0.5])
        ids = torch.arange(CHAINS)
        state, _ = found.accept(
            state, proposals, ids, *[torch.zeros(CHAINS)] * 2, generator, losses=losses
        )
    assert state.loss.tolist() == [0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5]
    assert torch.equal(state.seen[-1], proposals.position[3])


def test_losses_that_have_gradients_leave_none_in_the_state() -> None:
    found, generator = sampler(), torch.Generator().manual_seed(0)
    state = found.init(3)
    for batch in range(20):
        proposals = found.propose(state, generator, batch=batch)
        losses = torch.rand(CHAINS, generator=generator).double().requires_grad_()
        ids, target = torch.arange(CHAINS), torch.zeros(CHAINS)
        state, _ = found.accept(state, proposals, ids, target, target, generator, losses=losses)
    assert state.loss.dtype == torch.float32
    assert not state.loss.requires_grad
    assert not state.leaf.requires_grad


def test_a_forest_serves_until_an_eighth_of_what_is_remembered_is_newer() -> None:
    found = sampler(memory=64)
    state, generator = found.init(3), torch.Generator().manual_seed(0)
    seen, newer, grown = [], [], []
    for batch in range(24):
        before = state.forest
        proposals = found.propose(state, generator, batch=batch)
        losses = torch.rand(CHAINS, generator=generator)
        ids, zeros = torch.arange(CHAINS), torch.zeros(CHAINS)
        state, _ = found.accept(state, proposals, ids, zeros, zeros, generator, losses=losses)
        seen.append(len(state.seen))
        newer.append(int(state.newer))
        grown.append(not torch.equal(before.threshold, state.forest.threshold))
    assert seen == [min(CHAINS * batch, 64) for batch in range(1, 25)]
    # From 8 states on; 4 are an eighth of up to 32, and 8 of up to 64.
    assert grown == [False, *[True] * 7, *[False, True] * 8]
    assert newer == [4, *[0] * 7, *[4, 0] * 8]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"chains": 0}, "sampler.chains: 0"),
        ({"candidates": 3}, "sampler.candidates: 3: give at least 4"),
        ({"memory": 7}, "sampler.memory: 7: give at least 8"),
        ({"trees": 0}, "sampler.trees: 0"),
        ({"depth": 0}, "sampler.depth: 0"),
        ({"smallest_leaf": 0}, "sampler.smallest_leaf: 0"),
    ],
)
def test_numbers_out_of_range_are_refused(change: dict[str, int], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        sampler(**change)


def test_a_forest_that_no_memory_holds_is_refused_before_anything_is_rendered() -> None:
    """A texture of 148 x 148 texels that vary by themselves, as another scene may have them."""
    found = sampler(memory=4096, trees=4)
    assert found.init(2**14).seen.numel() == 0
    with pytest.raises(ValueError, match=r"sampler\.memory: 4 trees of 4096 states with 21906 var"):
        found.init(148 * 148 + 2)


def stream(folder: Path) -> TrainingStream:
    renderer = PocketRenderer(dimensions=3, volume=0.1, pockets=1, sharpness=0.0, patch_size=8)
    return make(folder, sampler=sampler(), renderer=renderer, rule=Epochs())


def test_an_interrupted_stream_goes_on_with_the_same_batches_and_weights(tmp_path: Path) -> None:
    """Stored patches keep the weights with which they were drawn."""
    whole = stream(tmp_path / "whole")
    for _ in steps(whole, 30):
        pass
    state = whole.state_dict()
    again = stream(tmp_path / "whole")
    again.load_state_dict(state)
    expected, found = list(steps(whole, 30)), list(steps(again, 30))
    for first, second in zip(expected, found, strict=True):
        assert_same(vars(first.patches), vars(second.patches))
        assert first.loss_weights is not None
        assert second.loss_weights is not None
        assert torch.equal(first.loss_weights, second.loss_weights)
    by_id: dict[int, float] = {}
    for batch in expected:
        assert batch.loss_weights is not None
        for patch, weight in zip(batch.ids.tolist(), batch.loss_weights.tolist(), strict=True):
            assert by_id.setdefault(patch, weight) == weight
    assert len(set(by_id.values())) > 10
