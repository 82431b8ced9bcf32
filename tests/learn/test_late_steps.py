"""Steps that are taken before anybody has looked at them come to the same, bit for bit."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
import torch
from torch import Tensor

from ngi.learn.batch import Feedback
from ngi.learn.step_guard import LARGEST_NORM, REFUSED_IN_A_ROW
from ngi.render import AnalyticRenderer, RenderedPatches
from ngi.reuse import (
    DrawingRule,
    Epochs,
    FixedProbability,
    Never,
    PolicyState,
    Prioritised,
    ProportionalToLoss,
    ReusePolicy,
    SelfTuning,
    UntilFull,
)
from tests.learn.comparison import assert_same
from tests.learn.late_training import OPTIMIZERS, STEPS, Harm, Known, Training
from tests.learn.small_stream import answer, make

NAN, INF = math.nan, math.inf


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> list[int]:
    """The steps on stored patches. Harm done to others changes nothing of which they are."""
    training = Training(tmp_path_factory.mktemp("plain"), late=False, numbers={})
    training.run(STEPS)
    steps = [number for number, generated in enumerate(training.generated, 1) if not generated]
    assert 10 < len(steps) < STEPS - 3
    return steps


def before_a_new_batch(stored: list[int]) -> int:
    return next(step for step in stored[2:] if step + 1 not in stored and step < STEPS)


def three_in_a_row(stored: list[int]) -> list[int]:
    return next([n, n + 1, n + 2] for n in stored[2:] if {n + 1, n + 2} <= {*stored})


CASES: dict[str, Callable[[list[int]], Harm]] = {
    "none": lambda _: Harm(),
    "a loss": lambda stored: Harm(loss={stored[4]: NAN}),
    "a loss before new patches": lambda stored: Harm(loss={before_a_new_batch(stored): INF}),
    "a loss of new patches": lambda stored: Harm(loss={before_a_new_batch(stored) + 1: NAN}),
    "the last loss": lambda stored: Harm(loss={stored[-1]: NAN}),
    "a gradient": lambda stored: Harm(gradient={stored[5]: NAN}),
    "a gradient that overflows": lambda stored: Harm(gradient={stored[5]: 1e30}),
    "an outlier": lambda stored: Harm(gradient={stored[6]: LARGEST_NORM / 4}),
    "outliers in a row": lambda stored: Harm(
        gradient=dict.fromkeys(three_in_a_row(stored), LARGEST_NORM / 4)
    ),
    "an outlier and a loss": lambda stored: Harm(
        gradient={three_in_a_row(stored)[0]: 1e15}, loss={three_in_a_row(stored)[1]: NAN}
    ),
    "losses in a row": lambda stored: Harm(loss=dict.fromkeys(three_in_a_row(stored), NAN)),
    "all until the first stored patches": lambda stored: Harm(
        loss=dict.fromkeys(range(1, stored[0] + 1), NAN)
    ),
}


def assert_told_the_same(late: Training, at_once: Training) -> None:
    assert [str(told) for told in late.outcomes] == [str(told) for told in at_once.outcomes]


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
@pytest.mark.parametrize("case", CASES)
def test_a_step_later_is_the_same(
    tmp_path: Path, stored: list[int], case: str, optimizer: str
) -> None:
    numbers: Known = {}
    harm = CASES[case](stored)
    at_once, late = (
        Training(
            tmp_path / name,
            late=late,
            numbers=numbers,
            harm=harm,
            optimizer=OPTIMIZERS[optimizer],
        )
        for name, late in (("at once", False), ("late", True))
    )
    at_once.run(STEPS)
    late.run(STEPS)
    assert len(late.outcomes) == STEPS - (STEPS in stored)  # the last is not looked at yet
    late.stream.settle()
    assert_told_the_same(late, at_once)
    assert_same(late.state(), at_once.state())
    assert len(numbers) == STEPS  # the same patches
    assert late.taken_back == len({*harm.loss, *harm.gradient} & {*stored})
    counters = late.stream.counters
    assert counters.steps_refused + counters.steps_scaled == len({*harm.loss, *harm.gradient})


@pytest.mark.parametrize("kind", ["loss", "gradient", "moment"])
def test_too_many_in_a_row_end_with_the_same_words_and_report(
    tmp_path: Path, stored: list[int], kind: str
) -> None:
    first = stored[3]
    steps = [first] if kind == "moment" else range(first, first + REFUSED_IN_A_ROW)
    numbers: Known = {}
    said, reports = [], []
    for name, late in (("at once", False), ("late", True)):
        (tmp_path / name).mkdir()
        training = Training(
            tmp_path / name,
            late=late,
            numbers=numbers,
            harm=Harm(**{kind: dict.fromkeys(steps, NAN)}),
        )
        with pytest.raises(
            FloatingPointError, match=rf"{REFUSED_IN_A_ROW}th skipped in a row"
        ) as end:
            training.run(STEPS)
        said.append(str(end.value).replace(str(tmp_path / name), ""))
        report = torch.load(tmp_path / name / "refused_step.pt", weights_only=True)
        assert report.pop("step") == first + REFUSED_IN_A_ROW - 1
        reports.append(report)
    assert said[0] == said[1]
    assert str(reports[0]) == str(reports[1])  # NaN is not equal to itself
    assert_same(reports[0]["weights"], reports[1]["weights"])


def test_saved_in_between_it_goes_on_as_one_that_is_not(tmp_path: Path, stored: list[int]) -> None:
    """The step that is under way when it is saved is one to be taken back."""
    middle = stored[8]
    harm = Harm(loss={middle: NAN})
    numbers: Known = {}
    unbroken = Training(tmp_path / "a", late=False, numbers=numbers, harm=harm)
    unbroken.run(STEPS)
    first = Training(tmp_path / "b", late=True, numbers=numbers, harm=harm)
    first.run(middle)
    with pytest.raises(RuntimeError, match=r"call settle\(\)"):
        first.state()
    first.stream.settle()
    state = copy.deepcopy(first.state())
    assert first.taken_back == 1
    second = Training(tmp_path / "b", late=True, numbers=numbers, harm=harm)
    second.load(state)
    for group, saved in zip(
        second.optimizer.param_groups, first.optimizer.param_groups, strict=True
    ):
        group["lr"] = saved["lr"]
    second.run(STEPS)
    second.stream.settle()
    final, expected = second.state(), unbroken.state()
    for state in (final, expected):
        del state["stream"]["store"]["segments"]  # the same patches, in other files
    assert_same(final, expected)


def test_an_outlier_right_after_a_resume_is_scaled_down_as_without_it(
    tmp_path: Path, stored: list[int]
) -> None:
    """The average of the gradients' norms is saved."""
    outlier = stored[8]
    numbers: Known = {}

    def training(folder: str) -> Training:
        harm = Harm(gradient={outlier: LARGEST_NORM / 4})
        return Training(tmp_path / folder, late=False, numbers=numbers, harm=harm)

    unbroken, first = training("a"), training("b")
    unbroken.run(outlier)
    first.run(outlier - 1)
    resumed = training("b")
    resumed.load(copy.deepcopy(first.state()))
    resumed.run(outlier)
    assert first.stream.counters.steps_scaled == 0
    assert resumed.stream.counters.steps_scaled == 1
    for part in ("network", "optimizer", "guard"):
        assert_same(resumed.state()[part], unbroken.state()[part])


def test_before_the_clock_pauses_the_last_step_is_looked_at(
    tmp_path: Path, stored: list[int]
) -> None:
    """An evaluation is not to see weights that are taken back."""
    numbers: Known = {}
    Training(tmp_path, late=False, numbers=numbers).run(STEPS)
    training = Training(tmp_path, late=True, numbers=numbers, harm=Harm(gradient={stored[4]: NAN}))
    training.run(stored[4])
    network = training.module.network
    assert not all(p.isfinite().all() for p in network.parameters())
    training.stream.catch_up()
    assert all(p.isfinite().all() for p in network.parameters())
    assert training.outcomes[-1][0] == stored[4]


POLICIES: dict[str, ReusePolicy] = {
    "never": Never(),
    "until full": UntilFull(),
    "fixed": FixedProbability(bootstrap_batches=3, probability=0.8),
    "self-tuning": SelfTuning(bootstrap_batches=3, beta=0.0, ema_coefficient=0.5),
}


class Largest(DrawingRule):
    """Of one's own, which says nothing about losses."""

    def draw(self, losses: Tensor, waiting: Tensor, count: int, *_) -> tuple[Tensor, Tensor]:
        return losses.argsort(descending=True)[:count], waiting


class WhereLossesAreLow(ReusePolicy):
    """The same."""

    def probability(self, state: PolicyState, *, generated_batches: int, **_) -> float:
        return 0 if generated_batches < 3 else 1 / (1 + (state.existing_loss or 0))

    def update(self, state: PolicyState, *, losses: Tensor, **rest) -> PolicyState:
        state = super().update(state, losses=losses, **rest)
        return replace(state, existing_loss=float(losses.mean()))


POLICIES["of one's own"] = WhereLossesAreLow()
RULES: dict[str, DrawingRule] = {
    "of one's own": Largest(),
    "epochs": Epochs(),
    "in proportion": ProportionalToLoss(),
    "prioritised": Prioritised(alpha=0.6, beta=1.0, epsilon=0.01),
}


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("rule", RULES)
def test_who_says_that_losses_do_not_matter_draws_the_same_whatever_they_are(
    tmp_path: Path, policy: str, rule: str
) -> None:
    drawn = []
    for factor in (0.1, 10.0):
        stream = make(
            tmp_path, greedy=False, policy=POLICIES[policy], rule=RULES[rule], capacity=24
        )
        batches, needed = [], set()
        for number, batch in enumerate(islice(stream, 40)):
            batches.append((batch.ids.tolist(), batch.loss_weights))
            if not batch.generated:
                needed.add(not stream.can_do_without(batch))
            losses = answer(batch).losses * factor ** (number % 3) * batch.ids
            stream.feedback(Feedback(losses, None, None))
        drawn.append(str(batches))
    if needed:  # stored ones were drawn
        assert needed == {drawn[0] != drawn[1]}
    assert needed or policy == "never"


def test_where_losses_matter_every_step_is_waited_for(tmp_path: Path, stored: list[int]) -> None:
    numbers: Known = {}
    harm = Harm(loss={stored[4]: NAN})
    at_once, asked = (
        Training(tmp_path, late=late, numbers=numbers, harm=harm, rule=ProportionalToLoss())
        for late in (False, True)
    )
    at_once.run(STEPS)
    asked.run(STEPS)
    assert len(asked.outcomes) == STEPS
    assert asked.taken_back == 0
    assert_told_the_same(asked, at_once)
    assert_same(asked.state()["network"], at_once.state()["network"])


@pytest.mark.parametrize("rule", [Epochs(), ProportionalToLoss()])
def test_a_stream_whose_batches_depend_on_losses_insists_on_them(
    tmp_path: Path, rule: DrawingRule
) -> None:
    stream = make(tmp_path, rule=rule)
    for batch in islice(stream, 20):
        if isinstance(rule, Epochs) and not batch.generated:
            stream.feedback_later(lambda: None)
        else:
            with pytest.raises(RuntimeError, match=r"call feedback\(\)"):
                stream.feedback_later(lambda: None)
            stream.feedback(answer(batch))
    assert stream.counters.iteration == 20


def test_a_step_is_looked_at_before_other_patches_are_proposed(tmp_path: Path) -> None:
    """In place of refused ones: a sampler may ask the network, whose step may be taken back."""
    unseen: list[int] = []
    when_proposed: list[int] = []

    class Refused(AnalyticRenderer):
        """Once, the fifth batch."""

        def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
            when_proposed.append(len(unseen))
            patches = super().render_patches(states, resolution=resolution, seed=seed)
            if len(when_proposed) == 5:
                patches.log_radiance[0] = NAN
            return patches

    policy = FixedProbability(bootstrap_batches=3, probability=0.8)
    renderer = Refused(dimensions=3, patch_size=8)
    stream = make(tmp_path, renderer=renderer, rule=Epochs(), policy=policy)
    for batch in islice(stream, 20):
        if batch.generated:
            stream.feedback(answer(batch))
        else:
            stream.settle()
            unseen.append(stream.counters.iteration)
            stream.feedback_later(unseen.clear)
    assert stream.counters.batches_refused == 1
    assert when_proposed[5] == 0
