"""SIGTERM, SIGHUP and Ctrl-C end a run soon, and without a step lost."""

import os
import pickle
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import torch

from ngi.learn import IlluminationModule, Interrupted, Interruption, TrainingStream
from ngi.render import AnalyticRenderer
from ngi.reuse import PatchStore
from tests.learn.command_line import start
from tests.learn.comparison import assert_same_run
from tests.learn.forked import configuration, run
from tests.learn.forked import start as start_forked
from tests.warm import finish

OFTEN = "evaluation.count=20"
"""Most of the time of these runs is evaluation."""


@pytest.fixture(autouse=True)
def _heard() -> Iterator[None]:
    """Ctrl-C counts where the tests run in the background of a script, which ignores it, too."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken")
    status, output = run(configuration(folder, OFTEN), folder / "output")
    assert status == 0, output
    return folder


def test_runs_ended_by_sigterm_at_any_moment_end_like_an_unbroken_one(
    tmp_path: Path, unbroken: Path
) -> None:
    since = time.monotonic()
    status, output = run(
        configuration(tmp_path / "timed", OFTEN, references=unbroken / "references"),
        tmp_path / "timed.log",
    )
    life = time.monotonic() - since
    assert status == 0, output
    generator = random.Random(7)
    config = configuration(tmp_path, OFTEN, references=unbroken / "references")
    statuses = []
    for _ in range(8):
        process = start_forked(config, tmp_path / "output")
        time.sleep(generator.uniform(0.1, 0.7) * life)
        process.terminate()
        process.join(timeout=30)
        statuses.append(process.exitcode)
        if process.exitcode == 143 and (tmp_path / "run" / "last.ckpt").exists():
            assert_no_step_is_lost(tmp_path / "run")
    assert set(statuses) <= {143, -signal.SIGTERM, 0}
    assert 143 in statuses
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert "ended by SIGTERM; to resume, repeat the command" in output
    assert_same_run(tmp_path / "run", unbroken / "run")


def assert_no_step_is_lost(folder: Path) -> None:
    saved = torch.load(folder / "last.ckpt", weights_only=True)["global_step"]
    assert pd.read_csv(folder / "steps.csv")["step"].iloc[-1] == saved


def at_call(owner: type, method: str, number: int, act: Callable[[], None]) -> None:
    """Does something in the middle of a run: before that call of a method of its parts."""
    original = getattr(owner, method)
    calls = 0

    def counted(*arguments: Any, **named: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == number:
            act()
        return original(*arguments, **named)

    setattr(owner, method, counted)


terminate_myself = partial(signal.raise_signal, signal.SIGTERM)


def leave() -> None:
    """Of this module, for `sys.exit` cannot be sent to a process once W&B has put its own there."""
    sys.exit(3)


@pytest.mark.parametrize(
    ("owner", "method", "number", "step"),
    [
        (AnalyticRenderer, "render_image", 9, None),  # in the fifth of 12 references
        (IlluminationModule, "training_step", 10, 10),
        (IlluminationModule, "predict", 16, 4),  # in the middle of the second evaluation
        (IlluminationModule, "on_train_batch_end", 10, 10),  # after all callbacks of a step
        (IlluminationModule, "on_train_end", 1, 40),
    ],
)
def test_sigterm_in_the_middle_of_anything(
    tmp_path: Path, unbroken: Path, owner: type, method: str, number: int, step: int | None
) -> None:
    rendering = owner is AnalyticRenderer
    references = tmp_path / "references" if rendering else unbroken / "references"
    config = configuration(tmp_path, OFTEN, references=references)
    first = partial(at_call, owner, method, number, terminate_myself)
    status, output = run(config, tmp_path / "output", first=first)
    assert status == 143, output
    assert "ended by SIGTERM; to resume, repeat the command" in output
    assert not [*tmp_path.rglob("*.partial")]
    if step is None:
        assert len([*references.iterdir()]) == 4
        assert not (tmp_path / "run" / "last.ckpt").exists()
    else:
        assert_no_step_is_lost(tmp_path / "run")
        steps = pd.read_csv(tmp_path / "run" / "steps.csv")["step"]
        assert steps.iloc[-1] == step
        if method == "predict":
            assert len(pd.read_csv(tmp_path / "run" / "metrics.csv")) == 1, "it was broken off"
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert_same_run(tmp_path / "run", unbroken / "run")


@pytest.mark.parametrize(
    ("owner", "method", "number"),
    [
        (PatchStore, "get", 20),  # of a batch that is stored already
        (IlluminationModule, "training_step", 20),
        (TrainingStream, "feedback", 20),  # after the optimiser's step
    ],
)
def test_an_exit_within_a_step_goes_on_from_the_checkpoint_before(
    tmp_path: Path, unbroken: Path, owner: type, method: str, number: int
) -> None:
    """As Submitit exits in its handler of SIGUSR2, wherever that comes."""
    config = configuration(tmp_path, OFTEN, references=unbroken / "references")
    first = partial(at_call, owner, method, number, leave)
    status, output = run(config, tmp_path / "output", first=first)
    assert status == 3, output
    assert "interrupted; saved" not in output
    saved = torch.load(tmp_path / "run" / "last.ckpt", weights_only=True)["global_step"]
    assert saved % 7 == 0
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert_same_run(tmp_path / "run", unbroken / "run")


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
def test_a_signal_ends_the_whole_sweep(tmp_path: Path, number: signal.Signals, status: int) -> None:
    endless = ("budget.steps=100000", "run.checkpoint_steps=7", "seed=0,1")
    log = tmp_path / "output"
    process = start(tmp_path, *endless, output=log, options=("--multirun",))
    try:
        while not (found := [*tmp_path.rglob("last.ckpt")]):
            assert process.is_alive(), log.read_text()
            time.sleep(0.01)
        os.kill(process.pid, number)
        found_status, output = finish(process, log, seconds=30)
    finally:
        process.kill()
    assert found_status == status, output
    assert f"ended by {number.name}; to resume, repeat the command" in output
    assert "interrupted; saved at step" in output
    assert_no_step_is_lost(found[0].parent)
    assert [folder.name for folder in tmp_path.rglob("seed=*")] == ["seed=0"]


def signals_in_hand(*numbers: signal.Signals, error: Exception | None = None) -> list[str]:
    """Gets signals while they are deferred, and says what was done all the same."""
    done = []
    with suppress(Interrupted), Interruption(of="a run") as interruption:
        with interruption.deferred():
            for number in numbers:
                signal.raise_signal(number)
            if error is not None:
                raise error
            done.append("what is in hand")
        done.append("what comes next")
    return done


def test_what_is_in_hand_is_finished_first() -> None:
    before = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)]
    for number in (signal.SIGTERM, signal.SIGINT):
        assert signals_in_hand(number) == ["what is in hand"]
    assert signals_in_hand(signal.SIGTERM, signal.SIGTERM) == ["what is in hand"], "as by `timeout`"
    assert signals_in_hand(signal.SIGTERM, signal.SIGINT) == ["what is in hand"]
    assert signals_in_hand() == ["what is in hand", "what comes next"]
    assert [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)] == before


def test_the_status_survives_the_way_from_a_process_of_a_sweep() -> None:
    assert pickle.loads(pickle.dumps(Interrupted(signal.SIGTERM))).code == 143


def test_a_second_ctrl_c_does_not_wait() -> None:
    with pytest.raises(KeyboardInterrupt):
        signals_in_hand(signal.SIGINT, signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signals_in_hand(signal.SIGTERM, signal.SIGINT, signal.SIGINT)


def test_an_error_while_saving_is_not_hidden_by_the_signal() -> None:
    with pytest.raises(OSError, match="disk full"):
        signals_in_hand(signal.SIGTERM, error=OSError("disk full"))


def test_a_signal_that_is_ignored_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Interruption(of="a job in the background"):
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
