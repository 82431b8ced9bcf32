"""What happens around each training step: feedback, logs, evaluations, checkpoints, the end.

Lightning calls them in the order of the trainer's list, and the order matters: the sampler learns
from a step before that step's state is saved.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from ngi.learn.budget import Budget
from ngi.learn.clock import PhaseClock, RunClock
from ngi.learn.interruption import Interruption
from ngi.learn.learning_rate import LearningRate
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.recorder import Recorder
from ngi.learn.run_folder import RunFolder
from ngi.learn.saving import BudgetAndCheckpoint, budget_used
from ngi.learn.schedule import Schedule
from ngi.learn.step_guard import StepGuard
from ngi.learn.stream import TrainingStream
from ngi.learn.tracker import Tracker


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

    def on_train_start(self, *_: Any) -> None:
        # A run that is trained longer has been evaluated more often by now than it would have been.
        self._done = min(self._done, self._due)
        self._evaluate_if_due()  # a signal came at this very step, before it was evaluated

    def on_train_batch_end(self, *_: Any) -> None:
        self._evaluate_if_due()

    def state_dict(self) -> dict[str, Any]:
        return {"done": self._done}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._done = state_dict["done"]

    def _evaluate_if_due(self) -> None:
        due = self._due
        if self._done < due < self._count:
            self._stream.finish_rendering()
            self._recorder.evaluate()
            self._done = due

    @property
    def _due(self) -> int:
        """Evaluations by now; the last of them once the budget is used up."""
        used = budget_used(self._budget, self._stream, self._run_clock)
        return int(used * self._count)


def callbacks(
    *,
    stream: TrainingStream,
    clock: PhaseClock,
    run_clock: RunClock,
    folder: RunFolder,
    tracker: Tracker,
    budget: Budget,
    schedule: Schedule,
    recorder: Recorder,
    evaluations: int,
    checkpoint_seconds: float,
    checkpoint_steps: int | None,
    interruption: Interruption,
) -> list[Callback]:
    """All callbacks of a run, in the order that they depend on.

    clock: the wall clock; run_clock: the one by which the budget ends, which may be the same
    """
    guard = StepGuard(stream=stream, folder=folder.path)
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
        LearningRate(schedule=schedule, budget=budget, stream=stream, run_clock=run_clock),
        PeriodicEvaluation(
            recorder=recorder, count=evaluations, budget=budget, stream=stream, run_clock=run_clock
        ),
        BudgetAndCheckpoint(
            budget=budget,
            schedule=schedule,
            stream=stream,
            clock=clock,
            run_clock=run_clock,
            folder=folder,
            every_seconds=checkpoint_seconds,
            every_steps=checkpoint_steps,
            interruption=interruption,
        ),
    ]
