"""Phases told apart by events of a pretended GPU, which works behind the host."""

from types import SimpleNamespace
from typing import Any

import pytest
import torch

from ngi.clock.phase_clock import PhaseClock
from ngi.clock.phase_events import PhaseEvents
from ngi.learn.callbacks import PhasesOnGpu


class Machine:
    """A host, whose time passes when it works or waits, and a GPU that works off its queue."""

    def __init__(self) -> None:
        self.now = 100.0
        self.busy_until = 0.0
        self.asked = 0

    def __call__(self) -> float:
        return self.now

    def work(self, seconds: float) -> None:
        self.now += seconds

    def queue(self, seconds: float) -> None:
        self.busy_until = max(self.now, self.busy_until) + seconds

    def wait(self) -> None:
        self.now = max(self.now, self.busy_until)

    def event(self) -> "MachineEvent":
        return MachineEvent(self)


class MachineEvent:
    def __init__(self, machine: Machine) -> None:
        self._machine = machine

    def record(self) -> None:
        self.at = max(self._machine.now, self._machine.busy_until)

    def query(self) -> bool:
        return self.at <= self._machine.now

    def elapsed_time(self, end_event: "MachineEvent") -> float:
        assert self.query(), "CUDA raises for an event that is not passed"
        assert end_event.query()
        self._machine.asked += 1
        return 1e3 * (end_event.at - self.at)


@pytest.fixture
def machine() -> Machine:
    return Machine()


@pytest.fixture
def clock(machine: Machine) -> PhaseClock:
    made = PhaseClock(timer=machine)
    made.divide_by(PhaseEvents(machine.event))
    made.start()
    return made


def seconds(clock: PhaseClock) -> dict[str, float]:
    clock.stop()
    return {phase: pytest.approx(s) for phase, s in clock.seconds.items() if s}


def test_work_counts_where_it_was_queued_not_where_it_is_waited_for(
    machine: Machine, clock: PhaseClock
) -> None:
    with clock.phase("train"):
        machine.queue(1)
        with clock.phase("score"):
            machine.queue(3)
        machine.queue(2)
        machine.wait()
    assert seconds(clock) == {"train": 3, "score": 3}
    assert clock.run_seconds == pytest.approx(6)


def test_what_the_host_takes_by_itself_stays_its_phases(
    machine: Machine, clock: PhaseClock
) -> None:
    with clock.phase("explore"):
        machine.work(4)
    with clock.phase("train"):
        machine.queue(1)
        machine.work(2)  # longer than the GPU takes
        machine.wait()
    machine.work(0.5)
    assert seconds(clock) == {"explore": 4, "train": 2, "other": 0.5}


def test_run_time_is_the_hosts_at_any_moment(machine: Machine, clock: PhaseClock) -> None:
    """Also where the GPU is behind at one end and not at the other."""
    for number in range(20):
        with clock.phase("score"):
            machine.queue(number % 3)
        with clock.phase("train"):
            machine.work(1)
            if number % 4 == 0:
                machine.wait()
        assert clock.run_seconds == pytest.approx(machine.now - 100)
    machine.wait()
    assert clock.run_seconds == pytest.approx(machine.now - 100)
    assert clock.seconds["score"] > clock.seconds["train"] > 0


def test_nothing_is_asked_of_what_the_gpu_has_not_passed(
    machine: Machine, clock: PhaseClock
) -> None:
    with clock.phase("score"):
        machine.queue(5)
        machine.work(1)
    with clock.phase("train"):
        machine.work(2)
    before = machine.asked
    assert clock.seconds["score"] == 1  # the host's, until more is known
    assert clock.run_seconds == 3
    assert machine.asked == before
    with clock.phase("train"):
        machine.wait()
    assert clock.seconds["score"] == pytest.approx(5)


def test_what_is_passed_bit_by_bit_comes_to_the_same(machine: Machine, clock: PhaseClock) -> None:
    for _ in range(5):
        with clock.phase("score"):
            machine.queue(3)
        for _ in range(4):  # looks at the clock while the GPU works
            with clock.phase("train"):
                machine.queue(0.5)
                machine.work(1)
            assert clock.run_seconds == pytest.approx(machine.now - 100)
        with clock.phase("train"):
            machine.wait()
    assert seconds(clock) == {"score": 15, "train": 10}


def test_what_is_left_to_do_in_a_pause_is_not_run_time(machine: Machine, clock: PhaseClock) -> None:
    for _ in range(3):
        with clock.phase("train"):
            machine.queue(2)
            machine.work(0.5)
        with clock.phase("evaluate"):
            machine.wait()
        with clock.phase("score"):
            machine.queue(1)
            machine.wait()
    assert seconds(clock) == {"train": 1.5, "evaluate": 4.5, "score": 3}


def test_pauses_neither_give_nor_take(machine: Machine, clock: PhaseClock) -> None:
    with clock.phase("train"):
        machine.queue(2)
        machine.wait()
    with clock.phase("evaluate"):
        machine.queue(7)
        machine.wait()
        assert clock.run_seconds == 2
        machine.work(1)
    with clock.phase("score"):
        machine.queue(1)
    with clock.phase("train"):
        machine.wait()
    assert seconds(clock) == {"train": 2, "evaluate": 8, "score": 1}


@pytest.mark.parametrize(("device", "events"), [("cuda", True), ("cpu", False)])
def test_a_run_on_a_gpu_has_events(
    device: str, events: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = Machine()
    monkeypatch.setattr(torch.cuda, "Event", lambda **_: machine.event())
    clock = PhaseClock(timer=machine)
    trainer: Any = SimpleNamespace(strategy=SimpleNamespace(root_device=torch.device(device)))
    PhasesOnGpu(clock).on_train_start(trainer)
    clock.start()
    with clock.phase("score"):
        machine.queue(3)
    with clock.phase("train"):
        machine.wait()
    assert seconds(clock) == ({"score": 3} if events else {"train": 3})


def test_time_that_never_began_does_not_end(machine: Machine) -> None:
    with pytest.raises(RuntimeError, match="call begin"):
        PhaseEvents(machine.event).end("train", 1.0)
