"""What happens after each training step: logs, learning rate, evaluations, checkpoints, the end.

Lightning calls them in the order of the trainer's list, and the order matters: a step is logged and
evaluated before its state is saved.
"""

from __future__ import annotations

from dataclasses import asdict, fields
from functools import partial
from typing import Any

import torch

from ngi.clock.phase_clock import PhaseClock, RunClock
from ngi.clock.phase_events import PhaseEvents
from ngi.files.run_folder import RunFolder
from ngi.learn.learning_rate import LearningRate
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
from ngi.learn.outcome import Outcome
from ngi.learn.recorder import Recorder
from ngi.learn.run import Run
from ngi.learn.saving import BudgetAndCheckpoint
from ngi.learn.stream import TrainingStream
from ngi.learn.tracker import Tracker

OUTCOME = [field.name for field in fields(Outcome)]


class PhasesOnGpu(Callback):
    """Has the run's clock tell the phases apart by CUDA events, where the network is on a GPU.

    It comes before `StepLog`, which starts the clock.
    """

    def __init__(self, clock: PhaseClock) -> None:
        self._clock = clock

    def on_train_start(self, trainer: Trainer, *_: Any) -> None:
        if trainer.strategy.root_device.type == "cuda":
            self._clock.divide_by(PhaseEvents(partial(torch.cuda.Event, enable_timing=True)))


class StepLog(Callback):
    """Starts and stops the clock, and logs each step."""

    def __init__(
        self,
        *,
        stream: TrainingStream,
        run_clock: RunClock,
        folder: RunFolder,
        tracker: Tracker,
    ) -> None:
        self._stream = stream
        self._clock = stream.clock
        self._run_clock = run_clock
        self._folder = folder
        self._tracker = tracker

    def on_train_start(self, *_: Any) -> None:
        self._clock.start()

    def on_train_batch_end(
        self, _trainer: Trainer, _module: LightningModule, outputs: Any, *_: Any
    ) -> None:
        row = {
            "step": self._stream.counters.iteration,
            "run_seconds": round(self._run_clock.run_seconds, 4),
            **dict.fromkeys(OUTCOME),
            **self._stream.log_row(),
        }
        outputs["step"].when_known(partial(self._log, row))
        if self._stream.chain_record is not None:
            step = self._stream.counters.iteration
            self._folder.chains.append({"step": step, **self._stream.chain_record})

    def _log(self, row: dict[str, Any], outcome: Outcome) -> None:
        """row: of the end of the step, when it was perhaps not known yet what came of it."""
        counters, store = self._stream.counters, self._stream.store
        row |= {
            **asdict(outcome),
            "store_mean_loss": store.mean_loss,
            "non_finite_losses": store.non_finite_losses,
            "steps_refused": counters.steps_refused,
            "steps_scaled": counters.steps_scaled,
        }
        self._folder.steps.append(row)
        self._tracker.step(row)

    def on_train_end(self, *_: Any) -> None:
        self._clock.stop()

    def state_dict(self) -> dict[str, Any]:
        return self._clock.state_dict()

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._clock.load_state_dict(state_dict)


class PeriodicEvaluation(Callback):
    """Evaluates `count` times, evenly over the budget; the last of them is left to the caller."""

    def __init__(self, run: Run, *, recorder: Recorder, count: int) -> None:
        if count < 1:
            raise ValueError(f"evaluation.count: {count}; expected at least 1 evaluation")
        self._run = run
        self._recorder = recorder
        self._count = count
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
            self._run.stream.catch_up()
            self._recorder.evaluate()
            self._done = due

    @property
    def _due(self) -> int:
        """Evaluations by now; the last of them once the budget is used up."""
        return int(self._run.budget_used * self._count + 1e-9)  # 0.29 * 100 is less than 29


def callbacks(
    run: Run,
    *,
    recorder: Recorder,
    evaluations: int,
    checkpoint_seconds: float,
    checkpoint_steps: int | None,
) -> list[Callback]:
    """All callbacks of a run, in the order that they depend on."""
    return [
        PhasesOnGpu(run.clock),
        StepLog(stream=run.stream, run_clock=run.run_clock, folder=run.folder, tracker=run.tracker),
        LearningRate(run),
        PeriodicEvaluation(run, recorder=recorder, count=evaluations),
        BudgetAndCheckpoint(run, every_seconds=checkpoint_seconds, every_steps=checkpoint_steps),
    ]
