"""What happens around each training step: feedback, logs, evaluations, checkpoints, the end.

Lightning calls them in the order of the trainer's list, and the order matters: the sampler learns
from a step before that step's state is saved.
"""

from __future__ import annotations

import logging
import sys
from contextlib import AbstractContextManager
from typing import Any

from tqdm import tqdm

from ngi.learn.budget import Budget
from ngi.learn.clock import PhaseClock, RunClock
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.recorder import Recorder
from ngi.learn.run_folder import RunFolder
from ngi.learn.step_guard import StepGuard
from ngi.learn.stream import TrainingStream
from ngi.learn.tracker import Tracker

log = logging.getLogger(__name__)


def budget_used(budget: Budget, stream: TrainingStream, clock: RunClock) -> float:
    """The part of the budget that is used up by now."""
    return budget.fraction(steps=stream.counters.iteration, run_seconds=clock.run_seconds)


class SamplerFeedback(Callback):
    """Times the training phase, hands each step's feedback to the stream and logs the step."""

    def __init__(
        self,
        *,
        stream: TrainingStream,
        clock: PhaseClock,
        run_clock: RunClock,
        folder: RunFolder,
        tracker: Tracker,
        guard: StepGuard,
    ) -> None:
        self._stream = stream
        self._clock = clock
        self._run_clock = run_clock
        self._folder = folder
        self._tracker = tracker
        self._guard = guard
        self._training: AbstractContextManager[None] | None = None

    def on_train_start(self, *_: Any) -> None:
        self._clock.start()

    def on_train_batch_start(self, *_: Any) -> None:
        self._training = self._clock.phase("train")
        self._training.__enter__()

    def on_train_batch_end(
        self, _trainer: Trainer, _module: LightningModule, outputs: Any, *_: Any
    ) -> None:
        assert self._training is not None
        loss = float(outputs["loss"])  # waits for the device, so that its time counts as training
        self._training.__exit__(None, None, None)
        self._stream.feedback(outputs["feedback"])
        row = {
            "step": self._stream.counters.iteration,
            "run_seconds": round(self._run_clock.run_seconds, 4),
            "loss": loss,
            "gradient_norm": self._guard.gradient_norm,
            **self._stream.log_row(),
        }
        self._folder.steps.append(row)
        if self._stream.chain_record is not None:
            step = self._stream.counters.iteration
            self._folder.chains.append({"step": step, **self._stream.chain_record})
        self._tracker.log(row)

    def on_train_end(self, *_: Any) -> None:
        self._clock.stop()

    def state_dict(self) -> dict[str, Any]:
        return self._clock.state_dict()

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._clock.load_state_dict(state_dict)


class PeriodicEvaluation(Callback):
    """Evaluates `count` times, evenly over the budget; the last of them is left to the caller."""

    def __init__(
        self,
        *,
        recorder: Recorder,
        count: int,
        budget: Budget,
        stream: TrainingStream,
        run_clock: RunClock,
    ) -> None:
        if count < 1:
            raise ValueError(f"evaluation.count: {count}; expected at least 1 evaluation")
        self._recorder = recorder
        self._count = count
        self._budget = budget
        self._stream = stream
        self._run_clock = run_clock
        self._done = 0

    def on_train_batch_end(self, *_: Any) -> None:
        used = budget_used(self._budget, self._stream, self._run_clock)
        due = int(used * self._count)
        if used < 1 and due > self._done:
            self._stream.finish_rendering()
            self._recorder.evaluate()
            self._done = due

    def state_dict(self) -> dict[str, Any]:
        return {"done": self._done}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._done = state_dict["done"]


class BudgetAndCheckpoint(Callback):
    """Shows progress, saves a checkpoint every so often, and ends the run when the budget is spent.

    every_seconds: run time between checkpoints, by the wall clock
    every_steps: further checkpoints after so many steps; None for none
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
    ) -> None:
        self._budget = budget
        self._stream = stream
        self._clock = clock
        self._run_clock = run_clock
        self._folder = folder
        self._every_seconds = every_seconds
        self._every_steps = every_steps
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
            with self._clock.phase("checkpoint"):
                self._save(trainer)
            self._saved_at, self._saved_step = self._clock.run_seconds, steps
        trainer.should_stop = used >= 1

    def on_train_end(self, *_: Any) -> None:
        self._close()

    def on_exception(
        self, _trainer: Trainer, _module: LightningModule, exception: BaseException
    ) -> None:
        self._close()
        if isinstance(exception, KeyboardInterrupt):
            log.warning(
                "%s: interrupted at step %d; the same command goes on from the last checkpoint, "
                "step %d",
                self._folder.path,
                self._stream.counters.iteration,
                self._saved_step,
            )

    def _save(self, trainer: Trainer) -> None:
        for log_file in self._folder.logs:
            log_file.flush()
        trainer.save_checkpoint(self._folder.checkpoint)
        self._stream.prune_archive()

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


def callbacks(
    *,
    stream: TrainingStream,
    clock: PhaseClock,
    run_clock: RunClock,
    folder: RunFolder,
    tracker: Tracker,
    budget: Budget,
    recorder: Recorder,
    evaluations: int,
    checkpoint_seconds: float,
    checkpoint_steps: int | None,
) -> list[Callback]:
    """All callbacks of a run, in the order that they depend on.

    clock: the wall clock; run_clock: the one by which the budget ends, which may be the same
    """
    guard = StepGuard(stream=stream, report=folder.path / "refused_step.pt")
    return [
        guard,
        SamplerFeedback(
            stream=stream,
            clock=clock,
            run_clock=run_clock,
            folder=folder,
            tracker=tracker,
            guard=guard,
        ),
        PeriodicEvaluation(
            recorder=recorder, count=evaluations, budget=budget, stream=stream, run_clock=run_clock
        ),
        BudgetAndCheckpoint(
            budget=budget,
            stream=stream,
            clock=clock,
            run_clock=run_clock,
            folder=folder,
            every_seconds=checkpoint_seconds,
            every_steps=checkpoint_steps,
        ),
    ]
