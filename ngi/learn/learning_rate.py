"""Steps are taken at the learning rates that the schedule says."""

from __future__ import annotations

from typing import Any

from ngi.learn.budget import Budget
from ngi.learn.clock import RunClock
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.saving import budget_used
from ngi.learn.schedule import Schedule
from ngi.learn.stream import TrainingStream


class LearningRate(Callback):
    """Sets the optimiser's learning rates for the next step, once the sampler has its feedback.

    They depend on the steps and the clock that a checkpoint holds, and on nothing before, so that a
    run that goes on goes on as one that was not broken off.
    """

    def __init__(
        self, *, schedule: Schedule, budget: Budget, stream: TrainingStream, run_clock: RunClock
    ) -> None:
        self._schedule = schedule
        self._budget = budget
        self._stream = stream
        self._run_clock = run_clock
        self._rates: list[float] = []

    def on_fit_start(self, trainer: Trainer, _module: LightningModule) -> None:
        # As configured: the checkpoint, whose rates may have fallen already, is not loaded yet.
        self._rates = [group["lr"] for group in _groups(trainer)]

    def on_train_start(self, trainer: Trainer, *_: Any) -> None:
        self._set(trainer)

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        self._set(trainer)

    def _set(self, trainer: Trainer) -> None:
        factor = self._schedule.factor(
            steps=self._stream.counters.iteration,
            used=budget_used(self._budget, self._stream, self._run_clock),
        )
        for group, rate in zip(_groups(trainer), self._rates, strict=True):
            group["lr"] = rate * factor


def _groups(trainer: Trainer) -> list[dict[str, Any]]:
    (optimizer,) = trainer.optimizers
    return optimizer.param_groups
