"""Steps are taken at the learning rates that the schedule says."""

from typing import Any

from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.run import Run


class LearningRate(Callback):
    """Sets the optimiser's learning rates for the next step, once the sampler has its feedback.

    The rates depend only on steps and clock, which a checkpoint holds. A resumed run therefore has
    the same rates as one that was never interrupted.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._rates: list[float] = []

    def on_fit_start(self, trainer: Trainer, _module: LightningModule) -> None:
        # As configured: the checkpoint, whose rates may have fallen already, is not loaded yet.
        self._rates = [group["lr"] for group in _groups(trainer)]

    def on_train_start(self, trainer: Trainer, *_: Any) -> None:
        self._set(trainer)

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        self._set(trainer)

    def _set(self, trainer: Trainer) -> None:
        factor = self._run.schedule.factor(
            steps=self._run.stream.counters.iteration, used=self._run.budget_used
        )
        for group, rate in zip(_groups(trainer), self._rates, strict=True):
            group["lr"] = rate * factor


def _groups(trainer: Trainer) -> list[dict[str, Any]]:
    (optimizer,) = trainer.optimizers
    return optimizer.param_groups
