import itertools
import json
import time
from pathlib import Path

import pandas as pd
import pytest

from ngi.clock.phase_clock import PAUSES, PHASES, PhaseClock
from ngi.machine.energy import EnergyCounter, EnergyMeter
from tests.learn.forked import configuration, run


class FakeTimer:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_only_the_innermost_phase_runs() -> None:
    timer = FakeTimer()
    clock = PhaseClock(timer=timer)
    clock.start()
    timer.now += 1
    with clock.phase("train"):
        timer.now += 2
        with clock.phase("score"):
            timer.now += 4
        timer.now += 8
    timer.now += 16
    clock.stop()
    timer.now += 32
    assert clock.seconds["train"] == 10
    assert clock.seconds["score"] == 4
    assert clock.seconds["other"] == 17
    assert clock.run_seconds == 31


@pytest.mark.parametrize("pause", PAUSES)
def test_pauses_do_not_count_as_run_time(pause: str) -> None:
    timer = FakeTimer()
    clock = PhaseClock(timer=timer)
    clock.start()
    with clock.phase(pause):
        timer.now += 5
    timer.now += 1
    assert clock.run_seconds == 1
    assert clock.seconds[pause] == 5


def test_time_before_start_and_while_stopped_does_not_count() -> None:
    timer = FakeTimer()
    clock = PhaseClock(timer=timer)
    timer.now += 7
    with clock.phase("score"):  # as a rehearsal does
        timer.now += 7
    clock.start()
    clock.stop()
    timer.now += 7
    with clock.phase("train"):
        timer.now += 7
    with clock.phase("evaluate"):
        timer.now += 3
    assert clock.run_seconds == 0
    assert clock.seconds["evaluate"] == 3


def test_an_exception_ends_its_phase() -> None:
    timer = FakeTimer()
    clock = PhaseClock(timer=timer)
    clock.start()

    def fail() -> None:
        with clock.phase("render"):
            timer.now += 3
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    timer.now += 1
    assert clock.run_seconds == 4
    assert clock.seconds["render"] == 3
    assert clock.seconds["other"] == 1


def test_seconds_survive_a_resume() -> None:
    timer = FakeTimer()
    first = PhaseClock(timer=timer)
    first.start()
    with first.phase("render"):
        timer.now += 3
    second = PhaseClock(timer=timer)
    second.load_state_dict(first.state_dict())
    timer.now += 50  # the machine was off
    second.start()
    with second.phase("render"):
        timer.now += 2
    assert second.seconds["render"] == 5
    assert second.run_seconds == 5


def test_energy_is_that_of_run_time() -> None:
    joules = [0.0]
    meter = EnergyMeter([EnergyCounter("processor", lambda: joules[0])])
    clock = PhaseClock(energy=meter)
    joules[0] += 1
    clock.start()
    joules[0] += 2
    for pause in PAUSES:
        with clock.phase(pause):
            joules[0] += 4
            state = clock.state_dict()
    with clock.phase("train"):
        joules[0] += 8
    clock.stop()
    joules[0] += 16
    with clock.phase("evaluate"):  # the last evaluation, after training
        joules[0] += 32
    joules[0] += 64
    assert clock.energy.joules == 10
    assert state["joules"] == 2

    resumed = PhaseClock(energy=EnergyMeter([EnergyCounter("processor", lambda: joules[0])]))
    resumed.load_state_dict(state)
    resumed.start()
    joules[0] += 3
    assert resumed.energy.joules == 5


def test_unknown_phase_is_named() -> None:
    with pytest.raises(KeyError, match="rendering"), PhaseClock().phase("rendering"):
        pass
    assert "render" in PHASES


def let_the_wall_clock_jump() -> None:
    """An hour ahead and two hours back, at every look at it."""
    now, jumps = time.time, itertools.cycle((3600, -7200))
    time.time = lambda: now() + next(jumps)


def test_a_wall_clock_that_jumps_changes_no_run_time(tmp_path: Path) -> None:
    config = configuration(tmp_path, "budget.steps=1000000", "budget.seconds=0.5")
    since = time.monotonic()
    status, output = run(config, tmp_path / "output", first=let_the_wall_clock_jump)
    passed = time.monotonic() - since
    assert status == 0, output
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert 0.5 <= result["run_seconds"] < passed
    assert 0 < result["seconds"]["evaluate"] < passed
    steps, metrics = (
        pd.read_csv(tmp_path / "run" / name)["run_seconds"] for name in ("steps.csv", "metrics.csv")
    )
    assert steps.is_monotonic_increasing
    assert len(metrics) == 3
    assert 0.5 / 3 <= metrics[0] < metrics[1] < metrics[2]
