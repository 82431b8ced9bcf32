"""Before the clock pauses, patches under way are waited for in run time."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from torch import Tensor

from ngi.learn import Budget, Interruption, Outcome, PhaseClock, Recorder, Run, Step, TrainingStream
from ngi.learn.callbacks import PeriodicEvaluation
from ngi.learn.saving import BudgetAndCheckpoint
from ngi.learn.schedule import ConstantRate
from ngi.render import AnalyticRenderer
from ngi.reuse import FixedProbability
from ngi.train import train
from tests.learn.forked import configuration
from tests.learn.late_renderers import Manual, ManualJob, Timer
from tests.learn.lightning_warnings import IGNORED
from tests.learn.small_stream import make, steps

HARDLY_EVER = FixedProbability(bootstrap_batches=3, probability=1e-12)


def late(folder: Path) -> tuple[TrainingStream, ManualJob, PhaseClock]:
    """A stream with 5 steps behind it and a job that takes 5 s under way."""
    renderer = Manual()
    clock = PhaseClock(timer=renderer.timer)
    stream = make(folder, policy=HARDLY_EVER, renderer=renderer, when_late="reuse", clock=clock)
    for _ in steps(stream, 5):
        pass
    assert not renderer.jobs[-1].done()
    clock.start()
    return stream, renderer.jobs[-1], clock


def run(stream: TrainingStream, *, steps: int, folder: Any = None) -> Run:
    """With what these callbacks ask for."""
    nothing: Any = None
    return Run(
        folder=folder,
        tracker=nothing,
        interruption=Interruption(of="a run"),
        budget=Budget(steps=steps),
        schedule=ConstantRate(),
        renderer=nothing,
        samples=nothing,
        stream=stream,
        module=nothing,
        run_clock=stream.clock,
    )


def test_an_evaluation_waits_in_run_time_for_patches_under_way(tmp_path: Path) -> None:
    stream, job, clock = late(tmp_path)
    seen = []
    recorder: Any = SimpleNamespace(evaluate=lambda: seen.append(job.done()))
    evaluation = PeriodicEvaluation(run(stream, steps=8), recorder=recorder, count=2)
    evaluation.on_train_batch_end()
    assert seen == [True]
    assert clock.seconds["render"] == clock.run_seconds == 5


def test_evaluations_come_at_their_steps_whatever_their_number(tmp_path: Path) -> None:
    seen: list[int] = []
    stream = make(tmp_path, policy=HARDLY_EVER)
    recorder: Any = SimpleNamespace(evaluate=lambda: seen.append(stream.counters.iteration))
    evaluation = PeriodicEvaluation(run(stream, steps=100), recorder=recorder, count=100)
    for _ in steps(stream, 100):
        evaluation.on_train_batch_end()
    assert seen == list(range(1, 100)), "0.29 * 100 is less than 29"


@IGNORED[0]
def test_the_last_evaluation_has_the_machine_for_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a frame takes is measured in it."""
    jobs: list[ManualJob] = []
    seen: list[bool] = []

    def start(renderer: AnalyticRenderer, states: Tensor, **of_image: int) -> ManualJob:
        jobs.append(ManualJob(renderer.render_patches(states, **of_image), Timer()))
        return jobs[-1]

    def finish(_: Recorder) -> dict[str, Any]:
        seen.append(all(job.finished for job in jobs))
        return {}

    monkeypatch.setattr(AnalyticRenderer, "start_patches", start)
    monkeypatch.setattr(Recorder, "finish", finish)
    train(configuration(tmp_path, "reuse.when_late=reuse"))
    assert seen == [True]


@pytest.mark.parametrize(("budget", "waits"), [(8, True), (5, False)])
def test_a_checkpoint_waits_for_patches_unless_the_run_is_over(
    tmp_path: Path, budget: int, waits: bool
) -> None:
    stream, job, clock = late(tmp_path)
    seen = []
    folder: Any = SimpleNamespace(
        path=tmp_path / "run",
        name="run",
        checkpoint=tmp_path / "last.ckpt",
        stable_checkpoint=tmp_path / "stable.ckpt",
        logs=(),
    )
    trainer: Any = SimpleNamespace(
        should_stop=False, save_checkpoint=lambda _: seen.append(job.done())
    )
    callback = BudgetAndCheckpoint(
        run(stream, steps=budget, folder=folder), every_seconds=1e9, every_steps=5
    )
    callback.on_train_start(trainer)
    module: Any = None
    step = Step()
    step.tell(Outcome(loss=1.0, gradient_norm=1.0))
    callback.on_train_batch_end(trainer, module, {"step": step})
    callback.on_train_end()
    assert seen == [waits]
    assert clock.run_seconds == (5 if waits else 0)
    assert trainer.should_stop == (not waits)
