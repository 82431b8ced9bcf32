"""Measures the components of `ngi.clock.costs`: in the training loop itself, and by rendering."""

# ruff: noqa: ARG002 - policies and rules are given more than these look at

from __future__ import annotations

import statistics
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from ngi.clock.phase_clock import PHASES
from ngi.explore import Acceptance
from ngi.learn import Batch, PhaseClock, Samples
from ngi.learn.lightning_api import Callback, Trainer
from ngi.machine.timing import repeated, timed
from ngi.reuse import PolicyState, ReusePolicy

Seconds = dict[str, list[float]]
"""Phase -> what was measured, in seconds."""

SIDE = 4
"""Width of the images that patches are cut from, in patches: 128 pixels for those of 32."""
WARM_UP_ROUNDS = 2
FEWEST_ROUNDS = 5
MOST_BATCHES = 50


def rendering_seconds(
    samples: Samples, *, count: int, patches_per_vector: int, seconds: float
) -> Seconds:
    """Of batches of so many samples, at states drawn uniformly from the scene's whole hypercube.

    Where chains gather a patch may cost more or less than on the average over the scene, but that
    differs from run to run.

    patches_per_vector: so many samples, one after the other, have the same scene vector
    seconds: after so long no batch is begun, once there were three
    """
    generator = torch.Generator().manual_seed(0)

    def render() -> None:
        states = torch.rand(count, samples.dimensions + 2, generator=generator)
        vectors = states[::patches_per_vector, :-2]
        states[:, :-2] = vectors.repeat_interleave(patches_per_vector, dim=0)[:count]
        seed = int(torch.randint(2**31, (), generator=generator))
        resolution = SIDE * samples.patch_size
        samples.start_patches(states, resolution=resolution, seed=seed).result()

    return {"render": repeated(MOST_BATCHES, "rendering", timed(render), seconds=seconds)}


class InTurn(ReusePolicy):
    """A generated batch, a reused one, and so on; the losses stay unknown."""

    by_loss = True  # so that each step is waited for, and its time is its own

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        """1 after a generated batch, else 0."""
        return float(state.generated_batches)

    def update(
        self, state: PolicyState, *, reused: bool, losses: Tensor, large_step: Tensor
    ) -> PolicyState:
        """Remembers what the last batch was."""
        return PolicyState(generated_batches=int(not reused))


class ScoredInTurn(Acceptance):
    """Accepts everything, and has every second generated batch scored.

    scored: whether there are scored batches at all
    """

    def __init__(self, *, scored: bool) -> None:
        self._scored = scored
        self._batches = 0

    @property
    def needs_current(self) -> bool:
        return self._scored and self._batches % 2 == 1

    def __call__(
        self, target_proposed: Tensor, target_current: Tensor, generator: torch.Generator
    ) -> Tensor:
        self._batches += 1
        return torch.ones_like(target_proposed, dtype=torch.bool)


@dataclass(frozen=True)
class TimedStep:
    """Seconds by phase of one training step."""

    generated: bool
    scored: bool
    seconds: dict[str, float]

    @property
    def own(self) -> float:
        """Seconds of all that a scored step may take longer: neither rendering nor the loop."""
        return sum(self.seconds[phase] for phase in ("explore", "reuse", "score", "train"))


class StepTimer(Callback):
    """Keeps the seconds of every step and ends training after `seconds`.

    It comes after `StepLog`. A round is a generated and a reused step, and where steps are
    scored another two whose generated one is; at least `FEWEST_ROUNDS` are timed after
    `WARM_UP_ROUNDS`, which do not count.
    """

    def __init__(self, *, clock: PhaseClock, scored: bool, seconds: float) -> None:
        self._clock = clock
        self._round = 4 if scored else 2
        self._limit = seconds
        self._end = float("inf")
        self._before = dict(clock.seconds)
        self._steps: list[TimedStep] = []

    def on_train_batch_end(
        self, trainer: Trainer, _module: Any, _outputs: Any, batch: Batch, *_: Any
    ) -> None:
        now = dict(self._clock.state_dict()["seconds"])
        took = {phase: now[phase] - self._before[phase] for phase in PHASES}
        self._before = now
        self._steps.append(TimedStep(batch.generated, batch.current is not None, took))
        rounds, rest = divmod(len(self._steps), self._round)
        if rest == 0 and rounds == WARM_UP_ROUNDS:
            self._end = time.perf_counter() + self._limit
        enough = rounds >= WARM_UP_ROUNDS + FEWEST_ROUNDS and time.perf_counter() >= self._end
        trainer.should_stop = rest == 0 and enough

    def rounds(self) -> Iterator[list[TimedStep]]:
        """The steps of each round: generated, reused, and perhaps scored, reused."""
        for start in range(WARM_UP_ROUNDS * self._round, len(self._steps), self._round):
            yield self._steps[start : start + self._round]


def step_seconds(rounds: Iterable[list[TimedStep]]) -> dict[str, Seconds]:
    """Component -> what was measured, a value per round, from steps that were made in turn.

    Where another process disturbs a step, the next kind can come out below it; costs are then 0.
    """
    training: Seconds = {"reuse": [], "train": [], "other": []}
    exploring: Seconds = {"explore": [], "reuse": [], "score": []}
    scoring: Seconds = {"score": []}
    for generated, reused, *further in rounds:
        for phase, values in training.items():
            stored = [step.seconds[phase] for step in (reused, *further[1:])]
            values.append(statistics.mean(stored))
        # The chains accept in the generated step; for the next, they propose in the reused one.
        exploring["explore"].append(generated.seconds["explore"] + reused.seconds["explore"])
        for phase in ("reuse", "score"):  # the losses' noise is told from two halves, as a score
            more = generated.seconds[phase] - reused.seconds[phase]
            exploring[phase].append(max(0.0, more))
        if further:
            scoring["score"].append(max(0.0, further[0].own - generated.own))
    if not any(exploring["score"]):
        del exploring["score"]
    measured = {"training": training, "exploring": exploring}
    return {**measured, "scoring": scoring} if scoring["score"] else measured
