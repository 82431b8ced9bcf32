"""Progress, checkpoints, and the end of a run: by its budget, or by a signal."""

from __future__ import annotations

import logging
import sys
from typing import Any

from tqdm import tqdm

from ngi.learn.budget import Budget
from ngi.learn.clock import PhaseClock, RunClock
from ngi.learn.interruption import Interruption
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.run_folder import RunFolder
from ngi.learn.stream import TrainingStream

log = logging.getLogger(__name__)


def budget_used(budget: Budget, stream: TrainingStream, clock: RunClock) -> float:
    """The part of the budget that is used up by now."""
    return budget.fraction(steps=stream.counters.iteration, run_seconds=clock.run_seconds)


class BudgetAndCheckpoint(Callback):
    """Shows progress, saves a checkpoint every so often, and ends the run when the budget is spent.

    every_seconds: run time between checkpoints, by the wall clock
    every_steps: further checkpoints after so many steps; None for none
    interruption: a signal that was deferred by it ends the run after this step, with a checkpoint
    """

    def __init__(
        self,
        *,
        budget: Budget,
        stream: TrainingStream,
        clock: PhaseClock,
        run_clock: RunClock,
        folder: RunFolder,
        every_seconds: float,
        every_steps: int | None,
        interruption: Interruption,
    ) -> None:
        self._budget = budget
        self._stream = stream
        self._clock = clock
        self._run_clock = run_clock
        self._folder = folder
        self._every_seconds = every_seconds
        self._every_steps = every_steps
        self._interruption = interruption
        self._saved_at = 0.0
        self._saved_step = 0
        self._bar: tqdm[Any] | None = None

    def on_train_start(self, trainer: Trainer, *_: Any) -> None:
        used = budget_used(self._budget, self._stream, self._run_clock)
        trainer.should_stop = used >= 1  # killed after its last step, before its result
        self._saved_at = self._clock.run_seconds
        self._saved_step = self._stream.counters.iteration
        self._bar = tqdm(
            total=100,
            initial=100 * min(used, 1.0),
            desc=self._folder.path.parent.name,
            bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}",
            mininterval=1.0 if sys.stderr.isatty() else 15.0,
        )

    def on_train_batch_end(
        self, trainer: Trainer, _module: LightningModule, outputs: Any, *_: Any
    ) -> None:
        steps, seconds = self._stream.counters.iteration, self._clock.run_seconds
        used = budget_used(self._budget, self._stream, self._run_clock)
        self._show(min(used, 1.0), float(outputs["loss"]))
        periodic = self._every_steps is not None and steps % self._every_steps == 0
        if used >= 1 or periodic or seconds - self._saved_at >= self._every_seconds:
            if used < 1:  # nobody waits for patches that no step follows
                self._stream.finish_rendering()
            self._save(trainer)
        trainer.should_stop = used >= 1
        self._interruption.check()

    def on_train_end(self, *_: Any) -> None:
        self._close()

    def on_exception(
        self, trainer: Trainer, _module: LightningModule, exception: BaseException
    ) -> None:
        if self._bar is None:
            return  # nothing is trained yet
        self._close()
        step = self._stream.counters.iteration
        if isinstance(exception, SystemExit):  # a deferred signal: the step is complete
            if self._saved_step < step:
                self._save(trainer)
            log.warning("%s: interrupted, and saved at step %d", self._folder.path, step)

    def _save(self, trainer: Trainer) -> None:
        with self._clock.phase("checkpoint"):
            for log_file in self._folder.logs:
                log_file.flush()
            trainer.save_checkpoint(self._folder.checkpoint)
            self._stream.prune_archive()
        self._saved_at = self._clock.run_seconds
        self._saved_step = self._stream.counters.iteration

    def _show(self, used: float, loss: float) -> None:
        assert self._bar is not None
        counters = self._stream.counters
        self._bar.set_postfix_str(
            f"step {counters.iteration}, loss {loss:.4f}, "
            f"{counters.patches_traced} patches traced, reuse {self._stream.reuse_probability:.2f}",
            refresh=False,
        )
        self._bar.update(100 * used - self._bar.n)

    def _close(self) -> None:
        if self._bar is not None:
            self._bar.close()
