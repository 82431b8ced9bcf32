"""Progress, checkpoints, and the end of a run: by its budget, or by a signal."""

from __future__ import annotations

import logging
import math
import sys
from typing import Any

from tqdm import tqdm

from ngi.files.durable import DamagedError, write_atomically
from ngi.learn.checkpoint import DECAYS_FROM, STREAM, read_checkpoint
from ngi.learn.interruption import Interrupted
from ngi.learn.lightning_api import Callback, LightningModule, SIGTERMException, Trainer
from ngi.learn.outcome import Outcome
from ngi.learn.run import Run

log = logging.getLogger(__name__)


class BudgetAndCheckpoint(Callback):
    """Shows progress, saves a checkpoint every so often, and ends the run when the budget is spent.

    A signal that was deferred ends it after this step, with a checkpoint. What else ends it, as the
    signals that Submitit exits by, may come within a step, which no checkpoint can hold: it goes on
    from the one before.

    Once the learning rate's schedule depends on how long the run is to be, the checkpoint of that
    step is kept too: a longer run goes on from it. The first step may be such a one; then there is
    none.

    every_seconds: run time between checkpoints, by the wall clock; 0 for one after every step
    every_steps: further checkpoints after so many steps; None for none
    Raises ValueError for numbers out of range.
    """

    def __init__(self, run: Run, *, every_seconds: float, every_steps: int | None) -> None:
        if every_seconds < 0:
            raise ValueError(f"run.checkpoint_seconds: {every_seconds}: give at least 0")
        if every_steps is not None and every_steps < 1:
            raise ValueError(
                f"run.checkpoint_steps: {every_steps}: give at least 1, or null for seconds only"
            )
        self._run = run
        self._every_seconds = every_seconds
        self._every_steps = every_steps
        self._saved_at = 0.0
        self._saved_step = 0
        self._decays_from: int | None = None  # the step after which a longer run would differ
        self._bar: tqdm[Any] | None = None
        self._loss = math.nan  # the latest that is known

    def on_train_start(self, trainer: Trainer, *_: Any) -> None:
        used = self._run.budget_used
        trainer.should_stop = used >= 1  # killed after its last step, before its result
        self._saved_at = self._run.clock.run_seconds
        self._saved_step = self._run.stream.counters.iteration
        self._go_on_decaying()
        self._bar = tqdm(
            total=100,
            initial=100 * min(used, 1.0),
            desc=self._run.folder.name,
            bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}",
            mininterval=1.0 if sys.stderr.isatty() else 15.0,
        )

    def on_train_batch_end(
        self, trainer: Trainer, _module: LightningModule, outputs: Any, *_: Any
    ) -> None:
        steps, seconds = self._run.stream.counters.iteration, self._run.clock.run_seconds
        used = self._run.budget_used
        outputs["step"].when_known(self._know)
        self._show(min(used, 1.0))
        periodic = self._every_steps is not None and steps % self._every_steps == 0
        decay_begins = self._decays_from is None and self._run.nears_its_end
        if decay_begins:
            self._decays_from = steps
        due = periodic or seconds - self._saved_at >= self._every_seconds
        if used >= 1 or decay_begins or due:
            if used < 1:  # nobody waits for patches that no step follows
                self._run.stream.catch_up()
            self._save(trainer)
        if decay_begins:
            self._keep_stable()
        trainer.should_stop = used >= 1
        self._run.interruption.check()

    def on_train_end(self, *_: Any) -> None:
        self._close()

    def on_exception(
        self, trainer: Trainer, _module: LightningModule, exception: BaseException
    ) -> None:
        if self._bar is None:
            return  # nothing is trained yet
        self._close()
        step = self._run.stream.counters.iteration
        if isinstance(exception, Interrupted | SIGTERMException):  # between two steps
            if self._saved_step < step:
                self._save(trainer)
            log.warning("%s: interrupted; saved at step %d", self._run.folder.path, step)

    def _save(self, trainer: Trainer) -> None:
        self._run.stream.settle()
        with self._run.clock.phase("checkpoint"):
            for log_file in self._run.folder.logs:
                log_file.flush()
            trainer.save_checkpoint(self._run.folder.checkpoint)
            self._run.stream.saved_stores.prune()
        self._saved_at = self._run.clock.run_seconds
        self._saved_step = self._run.stream.counters.iteration

    def state_dict(self) -> dict[str, Any]:
        return {DECAYS_FROM: self._decays_from}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._decays_from = state_dict[DECAYS_FROM]

    def _go_on_decaying(self) -> None:
        """What a resumed run has to know of the checkpoint before its decay."""
        step, stable = self._run.stream.counters.iteration, self._run.folder.stable_checkpoint
        if not self._run.nears_its_end:
            self._decays_from = None  # it is trained longer
        elif step == 0:
            self._decays_from = 0
        elif self._decays_from in (None, step):  # perhaps killed before it could be kept
            self._decays_from = step
            self._keep_stable()
        elif stable.exists():
            try:
                self._run.stream.saved_stores.keep(read_checkpoint(stable)[STREAM]["store"])
            except DamagedError as error:
                log.warning("%s; without it this run cannot be trained longer later", error)

    def _keep_stable(self) -> None:
        with self._run.clock.phase("checkpoint"):
            content = self._run.folder.checkpoint.read_bytes()
            write_atomically(self._run.folder.stable_checkpoint, content)
        self._run.stream.saved_stores.keep()

    def _know(self, outcome: Outcome) -> None:
        self._loss = outcome.loss

    def _show(self, used: float) -> None:
        assert self._bar is not None
        stream = self._run.stream
        self._bar.set_postfix_str(
            f"step {stream.counters.iteration}, loss {self._loss:.4f}, "
            f"{stream.counters.patches_traced} patches traced, "
            f"reuse {stream.reuse_probability:.2f}",
            refresh=False,
        )
        self._bar.update(100 * used - self._bar.n)

    def _close(self) -> None:
        if self._bar is not None:
            self._bar.close()
