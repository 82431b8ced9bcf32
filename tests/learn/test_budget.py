import pytest

from ngi.learn import Seconds, Steps


def test_steps_count_steps_alone() -> None:
    budget = Steps(steps=8)
    assert budget.fraction(steps=2, run_seconds=1e9) == 0.25
    assert budget.fraction(steps=8, run_seconds=0) == 1
    assert budget.maximum_steps == 8


def test_seconds_count_run_time_alone() -> None:
    budget = Seconds(seconds=40)
    assert budget.fraction(steps=10**9, run_seconds=10) == 0.25
    assert budget.fraction(steps=0, run_seconds=50) > 1
    assert budget.maximum_steps == -1


@pytest.mark.parametrize("steps", [0, -3])
def test_no_steps_are_no_budget(steps: int) -> None:
    with pytest.raises(ValueError, match=rf"budget\.steps: {steps} "):
        Steps(steps=steps)


@pytest.mark.parametrize("seconds", [0, -1.5, float("nan"), float("inf")])
def test_no_seconds_are_no_budget(seconds: float) -> None:
    with pytest.raises(ValueError, match=r"budget\.seconds: "):
        Seconds(seconds=seconds)
