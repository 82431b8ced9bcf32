"""The stream alone: a made-up training step answers each batch."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from ngi.explore import GrowingResolution, LatinHypercube, ProposalDistribution, Sobol
from ngi.learn import Budget, Progress, TrainingStream
from ngi.render import AnalyticRenderer
from ngi.render.protocol import RenderedPatches
from ngi.reuse import (
    DrawingRule,
    Epochs,
    FixedProbability,
    Never,
    Prioritised,
    ReusePolicy,
    SelfTuning,
    UntilFull,
)
from tests.learn.comparison import assert_same
from tests.learn.small_stream import CHAINS, answer, constant_resolution, make, steps


def test_first_batches_are_new_and_later_ones_are_not_all(tmp_path: Path) -> None:
    generated = [batch.generated for batch in steps(make(tmp_path), 40)]
    assert all(generated[:3])
    assert 5 < sum(generated[3:]) < 32


def test_a_reused_batch_holds_the_stored_patches(tmp_path: Path) -> None:
    stream = make(tmp_path, capacity=1000)
    seen = {}
    for batch in steps(stream, 40):
        for i, patch_id in enumerate(batch.ids.tolist()):
            if batch.generated:
                seen[patch_id] = batch.patches[i : i + 1]
            else:
                assert torch.equal(batch.patches.scene_vector[i], seen[patch_id].scene_vector[0])
                torch.testing.assert_close(
                    batch.patches.log_radiance[i], seen[patch_id].log_radiance[0], atol=2e-3, rtol=0
                )


def test_the_policy_s_averages_are_of_large_steps_alone(tmp_path: Path) -> None:
    """Paper, Sec. 6.1: computed again from every batch, of what the log says after it."""
    stream = make(tmp_path, policy=SelfTuning(bootstrap_batches=1, beta=0.0, ema_coefficient=0.5))
    averages: dict[bool, float] = {}  # by whether the batch was generated
    told_apart, batches = 0, iter(stream)
    for _ in range(60):
        batch = next(batches)
        feedback = answer(batch)
        stream.feedback(feedback)
        large = batch.patches.large_step
        if large.any():
            loss = feedback.losses[large].mean().item()
            if not averages:
                averages = {True: loss, False: loss}
            else:
                averages[batch.generated] = 0.5 * averages[batch.generated] + 0.5 * loss
            told_apart += not large.all()
        row = stream.log_row()
        assert row["loss_new"] == pytest.approx(averages[True], rel=1e-6)
        assert row["loss_existing"] == pytest.approx(averages[False], rel=1e-6)
    assert told_apart > 5
    assert abs(averages[True] / averages[False] - 1) > 1e-3  # exchanged columns would be seen


def test_the_log_tells_acceptance_of_large_steps_from_that_of_small_ones(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never())
    told_apart, batches = 0, iter(stream)
    for _ in range(30):
        stream.feedback(answer(next(batches)))
        record, row = stream.chain_record, stream.log_row()
        assert record is not None
        for name, of_them in (
            ("acceptance_rate", ~record["initialised"]),
            ("large_step_acceptance_rate", ~record["initialised"] & record["large_step"]),
            ("small_step_acceptance_rate", ~record["initialised"] & ~record["large_step"]),
        ):
            accepted = record["accepted"][of_them]
            expected = accepted.mean() if len(accepted) else float("nan")
            assert row[name] == pytest.approx(expected, nan_ok=True)
        told_apart += row["large_step_acceptance_rate"] != row["small_step_acceptance_rate"]
    assert told_apart > 5


def test_greedy_chains_climb(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never())
    current = [
        batch.current.log_radiance.mean(dim=(1, 2, 3))
        for batch in steps(stream, 60)
        if batch.current is not None
    ]
    targets = torch.stack(current)
    assert (targets[1:] >= targets[:-1]).all()
    assert targets[-1].mean() > targets[0].mean() + 0.05


def test_uniform_sampling_scores_nothing(tmp_path: Path) -> None:
    for batch in steps(make(tmp_path, greedy=False, policy=Never()), 10):
        assert batch.current is None


def test_the_current_states_survive_a_store_that_is_too_small_for_the_rest(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never(), capacity=2 * CHAINS)
    assert sum(batch.current is not None for batch in steps(stream, 50)) == 49


def test_a_fixed_data_set_is_gone_through_in_epochs(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=UntilFull(), rule=Epochs(), capacity=8 * CHAINS)
    batches = list(steps(stream, 8 * 6))
    assert [batch.generated for batch in batches] == [True] * 8 + [False] * 40
    drawn = torch.cat([batch.ids for batch in batches]).reshape(6, 8 * CHAINS)
    for epoch in drawn:
        assert torch.equal(epoch.sort().values, torch.arange(8 * CHAINS))
    assert torch.equal(drawn[0], torch.arange(8 * CHAINS)), "the first is that of generation"
    assert drawn.unique(dim=0).shape[0] == 6
    assert stream.counters.patches_traced == 8 * CHAINS


def test_what_was_drawn_by_priority_has_weights(tmp_path: Path) -> None:
    stream = make(tmp_path, rule=Prioritised(alpha=0.6, beta=1.0, epsilon=1e-6))
    losses = torch.zeros(1000)
    for batch in steps(stream, 40):
        if batch.generated:
            assert batch.loss_weights is None
        else:
            assert batch.loss_weights is not None
            expected = losses[batch.ids] ** -0.6
            torch.testing.assert_close(
                batch.loss_weights, expected / expected.max(), rtol=1e-4, atol=0
            )
            assert torch.equal(batch.to("cpu").loss_weights, batch.loss_weights)
        losses[batch.ids] = answer(batch).losses


def test_the_resolution_grows_with_the_steps(tmp_path: Path) -> None:
    schedule = GrowingResolution(start=16, step=4, every=3, end=24)
    stream = make(tmp_path, policy=Never(), schedule=schedule)
    resolutions = [int(batch.patches.resolution[0]) for batch in steps(stream, 12)]
    assert resolutions == [16] * 3 + [20] * 3 + [24] * 6


def test_same_seed_same_batches_other_seed_others(tmp_path: Path) -> None:
    first, same, other = (make(tmp_path / str(i), seed=s) for i, s in enumerate((0, 0, 1)))
    for a, b, c in zip(steps(first, 15), steps(same, 15), steps(other, 15), strict=True):
        assert torch.equal(a.patches.log_radiance, b.patches.log_radiance)
        assert torch.equal(a.ids, b.ids)
        assert not torch.equal(a.patches.scene_vector, c.patches.scene_vector)


HALF = FixedProbability(bootstrap_batches=3, probability=0.5)


@pytest.mark.parametrize(
    ("proposal", "policy", "rule"),
    [
        (None, HALF, None),
        (lambda: Sobol(seed=5), HALF, None),
        (LatinHypercube, HALF, None),
        (None, UntilFull(), Epochs()),
        (None, HALF, Prioritised(alpha=0.6, beta=0.4, epsilon=1e-6)),
    ],
)
def test_a_restored_stream_goes_on_bit_for_bit(
    tmp_path: Path,
    proposal: Callable[[], ProposalDistribution] | None,
    policy: ReusePolicy,
    rule: DrawingRule | None,
) -> None:
    def begin(seed: int) -> TrainingStream:
        return make(
            tmp_path / "a",
            seed=seed,
            greedy=proposal is None,
            proposal=None if proposal is None else proposal(),
            policy=policy,
            rule=rule,
            capacity=11 * CHAINS + 1,
        )

    unbroken = begin(seed=0)
    for _ in steps(unbroken, 20):
        pass
    state = unbroken.state_dict()
    restored = begin(seed=99)
    restored.load_state_dict(state)
    for a, b in zip(steps(unbroken, 20), steps(restored, 20), strict=True):
        assert a.generated == b.generated
        assert torch.equal(a.ids, b.ids)
        assert torch.equal(a.patches.buffers, b.patches.buffers)
        assert_same(a.loss_weights, b.loss_weights)
    assert repr(unbroken.log_row()) == repr(restored.log_row())  # NaN equals NaN here
    assert unbroken.new_losses.state_dict() == restored.new_losses.state_dict()


class NaNRenderer(AnalyticRenderer):
    """Its first two batches and the fifth hold NaN."""

    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)
        self.rendered: list[torch.Tensor] = []

    def render_patches(
        self, states: torch.Tensor, *, resolution: int, seed: int
    ) -> RenderedPatches:
        self.rendered.append(states)
        patches = super().render_patches(states, resolution=resolution, seed=seed)
        if len(self.rendered) in (1, 2, 5):
            patches.log_radiance[0] = float("nan")
        return patches


def test_sobol_points_follow_each_other_where_some_are_reused_or_refused(tmp_path: Path) -> None:
    renderer, sobol = NaNRenderer(), Sobol(seed=2)
    stream = make(tmp_path, greedy=False, proposal=sobol, renderer=renderer)
    for _ in steps(stream, 30):
        pass
    assert stream.counters.batches_refused == 3
    assert 10 < len(renderer.rendered) < 30
    for batch, states in enumerate(renderer.rendered):
        expected = sobol.propose(torch.zeros(CHAINS, 5), torch.Generator(), batch=batch)
        assert torch.equal(states, expected.position)


def test_a_batch_without_feedback_stops_the_stream(tmp_path: Path) -> None:
    batches = iter(make(tmp_path))
    next(batches)
    with pytest.raises(RuntimeError, match="feedback"):
        next(batches)


def test_a_batch_is_answered_once(tmp_path: Path) -> None:
    stream = make(tmp_path)
    told = answer(next(iter(stream)))
    stream.feedback(told)
    with pytest.raises(RuntimeError, match="feedback without a batch"):
        stream.feedback(told)


def test_a_patch_larger_than_the_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"7 pixels a side.*patch of 8"):
        make(tmp_path, schedule=constant_resolution(7))


def test_a_store_without_room_for_chains_and_batch_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"reuse\.store\.capacity: 7 .* at least 8"):
        make(tmp_path, capacity=7)


def test_log_columns_do_not_change(tmp_path: Path) -> None:
    stream = make(tmp_path)
    first = stream.log_row().keys()
    for _ in steps(stream, 10):
        pass
    assert stream.log_row().keys() == first


def test_an_unknown_word_for_late_patches_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"reuse\.when_late: 'skip'.*\['wait', 'reuse'\]"):
        make(tmp_path, when_late="skip")


def progress(stream: TrainingStream, *, steps: int, stored_alone: float) -> Progress:
    return Progress(
        budget=Budget(steps=steps),
        clock=stream.clock,
        counters=lambda: stream.counters,
        stored_alone=stored_alone,
    )


@pytest.mark.parametrize("late", ["wait", "reuse"])
def test_the_last_share_of_the_steps_is_on_stored_patches(late: str, tmp_path: Path) -> None:
    policy = FixedProbability(bootstrap_batches=3, probability=0.5, stored_alone=0.2)
    stream = make(tmp_path, policy=policy, when_late=late)
    stream.progress = progress(stream, steps=50, stored_alone=policy.stored_alone)
    generated = [batch.generated for batch in steps(stream, 50)]
    assert sum(generated[:40]) == pytest.approx(3 + 0.5 * 37, abs=1)
    assert generated[38:40].count(True) == 1, "new ones come to the end of the first share"
    assert not any(generated[40:])
    assert stream.counters.batches_postponed == 0


def test_a_batch_that_has_to_be_new_is_never_too_late(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=FixedProbability(bootstrap_batches=6, probability=0.5))
    stream.progress = progress(stream, steps=5, stored_alone=0.2)
    assert all(batch.generated for batch in steps(stream, 5))
