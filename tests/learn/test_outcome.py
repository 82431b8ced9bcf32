"""What came of a step, asked for before and after it is known."""

import pytest

from ngi.learn.outcome import Outcome, Step


def test_what_came_of_a_step_is_told_as_soon_as_it_is_known() -> None:
    step, outcome = Step(), Outcome(loss=2.0, gradient_norm=3.0)
    told: list[Outcome] = []
    step.when_known(told.append)
    with pytest.raises(RuntimeError, match="outcome is not known yet"):
        _ = step.outcome
    assert told == []
    step.tell(outcome)
    assert step.outcome is outcome
    assert told == [outcome]
    step.when_known(told.append)
    assert told == [outcome] * 2
