import pytest

from ngi.learn.clock import PAUSES, PHASES, PhaseClock


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
    clock.start()
    clock.stop()
    timer.now += 7
    assert clock.run_seconds == 0


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


def test_unknown_phase_is_named() -> None:
    with pytest.raises(KeyError, match="rendering"), PhaseClock().phase("rendering"):
        pass
    assert "render" in PHASES
