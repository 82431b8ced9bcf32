"""Steps are taken at the learning rates that the schedule says."""

from typing import Any

from torch.optim import Optimizer

from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.run import Run


class BaseRates:
    """The learning rates that an optimiser has when this is made, one per group."""

    def __init__(self, optimizer: Optimizer) -> None:
        self._optimizer = optimizer
        self._rates = [group["lr"] for group in optimizer.param_groups]

    def scale(self, factor: float) -> None:
        """The next step is taken at so many times these rates."""
        for group, rate in zip(self._optimizer.param_groups, self._rates, strict=True):
            group["lr"] = rate * factor


class LearningRate(Callback):
    """Sets the optimiser's learning rates for the next step, once the sampler has its feedback.

    The rates depend only on steps and clock, which a checkpoint holds. A resumed run therefore has
    the same rates as one that was never interrupted.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._base: BaseRates

    def on_fit_start(self, trainer: Trainer, _module: LightningModule) -> None:
        # As configured: the checkpoint, whose rates may have fallen already, is not loaded yet.
        (optimizer,) = trainer.optimizers
        self._base = BaseRates(optimizer)

    def on_train_start(self, *_: Any) -> None:
        self._set()

    def on_train_batch_end(self, *_: Any) -> None:
        self._set()

    def _set(self) -> None:
        steps = self._run.stream.counters.iteration
        self._base.scale(self._run.schedule.factor(steps=steps, used=self._run.schedule_used))
