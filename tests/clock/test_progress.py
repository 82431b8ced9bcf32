"""What part of its steps a run has taken, and when a new batch comes too late."""

from dataclasses import dataclass, field

import pytest

from ngi.clock.counters import Counters
from ngi.learn import Budget, Progress
from ngi.reuse import FixedProbability

STORED_ALONE = 0.2


@dataclass
class Machine:
    """A clock by which a step takes `step` seconds, and a new batch `batch` seconds besides."""

    step: float
    batch: float
    counters: Counters = field(default_factory=Counters)
    name = "made up"

    @property
    def seconds(self) -> dict[str, float]:
        of_step = {"train": 0.7, "reuse": 0.1, "other": 0.2}
        of_batch = {"render": 0.9, "explore": 0.06, "score": 0.04}
        steps = self.step * self.counters.iteration
        batches = self.batch * self.counters.generated_batches
        return {
            **{phase: steps * part for phase, part in of_step.items()},
            **{phase: batches * part for phase, part in of_batch.items()},
        }

    @property
    def run_seconds(self) -> float:
        return sum(self.seconds.values())

    def progress(self, budget: Budget) -> Progress:
        return Progress(
            budget=budget, clock=self, counters=lambda: self.counters, stored_alone=STORED_ALONE
        )


def test_of_a_budget_of_steps_it_is_the_share_of_the_budget() -> None:
    machine = Machine(step=1, batch=100)
    progress = machine.progress(Budget(steps=50))
    assert progress.share() == 0
    for taken, share in ((10, 0.2), (39, 0.78), (40, 0.8), (50, 1)):
        machine.counters.iteration = taken
        assert progress.share() == progress.share(new_batches=1) == share
        assert progress.too_late == (taken >= 40)


def test_of_a_budget_of_seconds_it_counts_the_steps_that_fit_into_what_is_left() -> None:
    machine = Machine(step=0.1, batch=4)
    progress = machine.progress(Budget(seconds=100))
    assert progress.share() == progress.share(new_batches=1) == 0
    machine.counters.iteration, machine.counters.generated_batches = 100, 10
    assert progress.share() == pytest.approx(100 / (100 + 500))  # 50 s of 0.1 s each
    assert progress.share(new_batches=1) == pytest.approx(100 / (100 + 460))
    machine.counters.iteration, machine.counters.generated_batches = 200, 20
    assert progress.share() == 1


def test_of_two_limits_the_one_that_leaves_fewer_steps_counts() -> None:
    machine = Machine(step=0.1, batch=4)
    machine.counters.iteration, machine.counters.generated_batches = 100, 10
    assert machine.progress(Budget(steps=400, seconds=100)).share() == pytest.approx(0.25)
    assert machine.progress(Budget(steps=4000, seconds=100)).share() == pytest.approx(1 / 6)


def test_a_clock_that_stands_still_leaves_no_end_of_steps() -> None:
    machine = Machine(step=0, batch=0)
    machine.counters.iteration = 7
    assert machine.progress(Budget(seconds=100)).share() == 0


@pytest.mark.parametrize("seconds", [200.0, 600.0])
@pytest.mark.parametrize(("step", "batch"), [(0.03, 0.5), (0.03, 18.0), (0.05, 3.0), (0.03, 0.01)])
def test_the_last_fifth_of_the_steps_is_on_stored_patches(
    step: float, batch: float, seconds: float
) -> None:
    """However dear a batch is; and patches are trained on as often as the policy says."""
    machine, budget = Machine(step=step, batch=batch), Budget(seconds=seconds)
    progress = machine.progress(budget)
    policy = FixedProbability.by_samples(
        bootstrap_batches=4, times_at_32=12.5, samples_per_pixel=32, stored_alone=STORED_ALONE
    )
    counters, new = machine.counters, []
    while budget.fraction(steps=counters.iteration, run_seconds=machine.run_seconds) < 1:
        generated = counters.generated_batches
        probability = policy.probability(
            policy.init(), generated_batches=generated, store_size=generated, store_capacity=10**6
        )
        reused = policy.reuses(
            probability, draw=0.5, batches=counters.iteration, generated_batches=generated
        )
        if not (reused or (probability > 0 and progress.too_late)):
            new.append(counters.iteration)
            counters.generated_batches += 1
        counters.iteration += 1
    total = counters.iteration
    assert new[-1] < (1 - STORED_ALONE) * total + 1
    assert machine.run_seconds <= seconds + 1.01 * step, "no batch is begun that is cut off"
    between = 12.5 * (1 - STORED_ALONE)
    unused = (1 - STORED_ALONE) * total - new[-1]
    assert unused < between + batch / step + 1, "as many are new as fit"
    assert len(new) == pytest.approx(4 + (new[-1] - 4) / between, abs=1.01)
