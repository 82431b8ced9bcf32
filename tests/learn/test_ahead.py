"""Patches rendered ahead: the same numbers as in turn, and who waits for whom."""

import io
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
import torch

from ngi.explore import GrowingResolution, LossTimesStep
from ngi.learn import (
    IlluminationModule,
    PhaseClock,
    StepGuard,
    TrainingStream,
    patch_example,
    seeded,
    training_step,
)
from ngi.learn.ahead import ProposalsAhead
from ngi.learn.batch import Batch
from ngi.models import L1Dssim, PixelGenerator
from ngi.render import AnalyticRenderer
from ngi.reuse import FixedProbability, Never
from tests.learn.comparison import assert_same
from tests.learn.late_renderers import InThread, Manual
from tests.learn.small_stream import answer, make, steps

HALF = FixedProbability(bootstrap_batches=3, probability=0.5)
HARDLY_EVER = FixedProbability(bootstrap_batches=3, probability=1e-12)
GROWING = GrowingResolution(start=24, step=2, every=3, end=60)


@pytest.fixture
def in_thread() -> Iterator[InThread]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # two pools of threads on two cores would spin against each other
    with ThreadPoolExecutor(
        max_workers=1, initializer=torch.set_num_threads, initargs=(1,)
    ) as pool:
        yield InThread(pool)
    torch.set_num_threads(threads)


def in_turn() -> AnalyticRenderer:
    """What `InThread` renders, in this thread."""
    return AnalyticRenderer(dimensions=3, patch_size=12, noise=0.1)


def learner(stream: TrainingStream) -> IlluminationModule:
    return IlluminationModule(
        network=seeded(PixelGenerator, seed=0)(
            layout=in_turn().layout,
            scene_dimensions=3,
            hidden_features=8,
            hidden_layers=2,
        ),
        loss=L1Dssim(l1_weight=1.0, dssim_weight=1.0),
        optimizer=lambda parameters: torch.optim.Adam(parameters, lr=1e-2),
        example=patch_example,
        stream=stream,
        guard=StepGuard(stream=stream, folder=Path()),
    )


def train(stream: TrainingStream, module: IlluminationModule, count: int) -> Iterator[Batch]:
    """The stream's batches, each trained on before the next one."""
    optimizer = module.configure_optimizers()
    for batch in islice(stream, count):
        training_step(batch, module.learner, optimizer=optimizer)
        yield batch


def assert_same_batches(a: Batch, b: Batch) -> None:
    assert a.generated == b.generated
    assert (a.current is None) == (b.current is None)
    assert torch.equal(a.ids, b.ids)
    assert_same(vars(a.patches), vars(b.patches))
    if a.current is not None and b.current is not None:
        assert_same(vars(a.current), vars(b.current))


@pytest.mark.parametrize("policy", [HALF, Never()])
def test_ahead_and_in_turn_give_the_same_numbers(
    tmp_path: Path, in_thread: InThread, policy: FixedProbability | Never
) -> None:
    renderers = (in_turn(), in_thread)
    turn, ahead = (
        make(
            tmp_path / str(i),
            policy=policy,
            renderer=renderer,
            schedule=GROWING,
            target=LossTimesStep(),
        )
        for i, renderer in enumerate(renderers)
    )
    turn_network, ahead_network = learner(turn), learner(ahead)
    before = turn_network.network.state_dict()["output_layer.weight"].clone()
    pairs = zip(train(turn, turn_network, 30), train(ahead, ahead_network, 30), strict=True)
    for a, b in pairs:
        assert_same_batches(a, b)
        assert repr(turn.log_row()) == repr(ahead.log_row())  # NaN equals NaN here
    assert_same(turn.state_dict(), ahead.state_dict())
    stored = [vars(stream.store.get(stream.store.ids)) for stream in (turn, ahead)]
    assert_same(stored[0], stored[1])
    assert_same(turn_network.network.state_dict(), ahead_network.network.state_dict())
    assert not torch.equal(turn_network.network.state_dict()["output_layer.weight"], before)


def test_proposals_are_started_before_the_reused_batches_that_follow(tmp_path: Path) -> None:
    renderer = Manual()
    generated = reused = 0
    for batch in steps(make(tmp_path, policy=HALF, renderer=renderer), 40):
        generated += batch.generated
        reused += not batch.generated
        assert len(renderer.jobs) == generated + (not batch.generated)
        if batch.generated:
            states, _ = renderer.asked[-1]
            assert torch.equal(states[:, :-2], batch.patches.scene_vector)
            assert torch.equal(states[:, -2:], batch.patches.position)
    assert min(generated, reused) > 5


def test_late_patches_are_waited_for(tmp_path: Path) -> None:
    renderer = Manual()
    clock = PhaseClock(timer=renderer.timer)
    clock.start()
    stream = make(tmp_path, policy=HALF, renderer=renderer, clock=clock)
    same = make(tmp_path / "in turn", policy=HALF)
    for late, reference in zip(steps(stream, 40), steps(same, 40), strict=True):
        assert_same_batches(late, reference)
    assert renderer.waited == stream.counters.generated_batches > 5
    assert stream.counters.batches_postponed == 0
    assert clock.seconds["render"] == 5 * renderer.waited
    assert clock.run_seconds == 5 * renderer.waited


def test_instead_of_waiting_stored_patches_are_trained_on(tmp_path: Path) -> None:
    renderer = Manual()
    stream = make(tmp_path, policy=HARDLY_EVER, renderer=renderer, when_late="reuse")
    assert [batch.generated for batch in steps(stream, 20)] == [True] * 3 + [False] * 17
    assert renderer.waited == 3  # the bootstrap's
    assert stream.log_row()["batches_postponed"] == 17
    renderer.jobs[-1].finished = True
    late, following = steps(stream, 2)
    assert late.generated
    assert torch.equal(late.patches.scene_vector, renderer.asked[3][0][:, :-2])
    assert not following.generated
    assert renderer.waited == 3
    assert stream.log_row()["batches_postponed"] == 18


def test_what_the_policy_reuses_is_not_postponed(tmp_path: Path) -> None:
    always = FixedProbability(bootstrap_batches=3, probability=1.0)
    stream = make(tmp_path, policy=always, renderer=Manual(), when_late="reuse")
    assert sum(batch.generated for batch in steps(stream, 20)) == 3
    assert stream.counters.batches_postponed == 0


def test_a_policy_that_never_reuses_is_obeyed(tmp_path: Path) -> None:
    stream = make(tmp_path, policy=Never(), renderer=Manual(), when_late="reuse")
    assert all(batch.generated for batch in steps(stream, 10))
    assert stream.counters.batches_postponed == 0


def test_patches_have_the_resolution_they_were_rendered_at(tmp_path: Path) -> None:
    renderer = Manual()
    schedule = GrowingResolution(start=16, step=1, every=1, end=400)
    stream = make(tmp_path, policy=HALF, renderer=renderer, schedule=schedule)
    proposed_at = 0
    for iteration, batch in enumerate(steps(stream, 40)):
        states, asked = renderer.asked[-1]
        assert asked == stream.log_row()["resolution"] == 16 + proposed_at
        if batch.generated:
            assert (batch.patches.resolution == asked).all()
            again = renderer.render_patches(states, resolution=asked, seed=0)
            torch.testing.assert_close(
                batch.patches.log_radiance, again.log_radiance, atol=2e-3, rtol=0
            )
            proposed_at = iteration + 1
    assert proposed_at > 20


def restored(folder: Path, state: dict[str, Any], renderer: AnalyticRenderer) -> TrainingStream:
    """A stream that goes on from `state` as a checkpoint holds it."""
    file = io.BytesIO()
    torch.save(state, file)
    file.seek(0)
    stream = make(folder, policy=HALF, renderer=renderer, schedule=GROWING, seed=99)
    stream.load_state_dict(torch.load(file, weights_only=True))
    return stream


def test_a_run_resumed_amid_reuse_goes_on_bit_for_bit(tmp_path: Path, in_thread: InThread) -> None:
    unbroken = make(tmp_path, policy=HALF, renderer=in_thread, schedule=GROWING)
    for index, batch in enumerate(steps(unbroken, 100)):
        if index > 10 and not batch.generated:
            break
    unbroken.feedback(answer(batch))
    state = unbroken.state_dict()
    assert state["ahead"] is not None
    resumed = restored(tmp_path, state, in_thread)
    waiting = restored(tmp_path, state, in_turn())
    runs = [steps(stream, 20) for stream in (unbroken, resumed, waiting)]
    for a, b, c in zip(*runs, strict=True):
        assert_same_batches(a, b)
        assert_same_batches(a, c)
    assert_same(unbroken.state_dict(), resumed.state_dict())


def test_nothing_is_rendered_before_the_first_batch_is_asked_for(tmp_path: Path) -> None:
    first = make(tmp_path, policy=HARDLY_EVER, renderer=Manual(), when_late="reuse")
    for _ in steps(first, 5):
        pass
    renderer = Manual()
    resumed = restored(tmp_path, first.state_dict(), renderer)
    assert renderer.jobs == []
    next(iter(resumed))
    assert torch.equal(renderer.asked[0][0], first.state_dict()["ahead"]["position"])
    assert renderer.asked[0][1] == first.state_dict()["ahead"]["resolution"]


def test_patches_that_nobody_renders_are_not_waited_for(tmp_path: Path) -> None:
    stream = make(tmp_path)
    next(iter(stream))
    ahead = ProposalsAhead.from_state_dict(stream.state_dict()["ahead"])
    assert not ahead.late
    with pytest.raises(RuntimeError, match=r"start\(\)"):
        ahead.result()
