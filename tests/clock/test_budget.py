import pytest

from ngi.learn import Budget


def test_a_budget_in_steps_counts_steps_alone() -> None:
    budget = Budget(steps=8)
    assert budget.fraction(steps=2, run_seconds=1e9) == 0.25
    assert budget.fraction(steps=8, run_seconds=0) == 1
    assert budget.maximum_steps == 8


def test_a_budget_in_seconds_counts_run_time_alone() -> None:
    budget = Budget(seconds=40)
    assert budget.fraction(steps=10**9, run_seconds=10) == 0.25
    assert budget.fraction(steps=0, run_seconds=50) > 1
    assert budget.maximum_steps == -1


@pytest.mark.parametrize(
    ("steps", "run_seconds", "used"), [(2, 30, 0.75), (6, 10, 0.75), (8, 0, 1), (0, 40, 1)]
)
def test_of_two_limits_the_one_used_up_first_counts(
    steps: int, run_seconds: float, used: float
) -> None:
    budget = Budget(steps=8, seconds=40)
    assert budget.fraction(steps=steps, run_seconds=run_seconds) == used
    assert budget.maximum_steps == 8


@pytest.mark.parametrize("steps", [0, -3])
def test_no_steps_are_no_budget(steps: int) -> None:
    with pytest.raises(ValueError, match=rf"budget\.steps: {steps}; "):
        Budget(steps=steps)


@pytest.mark.parametrize("seconds", [0, -1.5, float("nan"), float("inf")])
def test_no_seconds_are_no_budget(seconds: float) -> None:
    with pytest.raises(ValueError, match=r"budget\.seconds: "):
        Budget(steps=1, seconds=seconds)


def test_no_limit_is_no_budget() -> None:
    with pytest.raises(ValueError, match=r"budget\.steps and budget\.seconds"):
        Budget()


def test_an_unknown_clock_is_refused() -> None:
    with pytest.raises(ValueError, match=r"budget\.clock: 'sun'.*wall.*model"):
        Budget(steps=1, clock="sun")


def test_the_model_clock_needs_costs() -> None:
    with pytest.raises(ValueError, match=r"budget\.costs: null.*ngi costs"):
        Budget(steps=1, clock="model")
