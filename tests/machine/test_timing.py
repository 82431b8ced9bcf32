from itertools import count

import pytest

from ngi.machine.timing import FEWEST, alternated, in_turn, repeated


def test_functions_take_turns() -> None:
    calls: list[str] = []
    seconds = in_turn(2, "", lambda: calls.append("a"), lambda: calls.append("b"))
    assert calls == ["a", "b", "a", "b", "a", "b"]
    assert [len(s) for s in seconds] == [2, 2]


def test_what_was_timed_elsewhere_is_kept_apart_and_without_the_warm_up() -> None:
    slow, fast = count(100), count()
    seconds = alternated(3, "", lambda: float(next(slow)), lambda: float(next(fast)))
    assert seconds == [[101, 102, 103], [1, 2, 3]]


@pytest.mark.parametrize(
    ("seconds", "expected"), [(1000.0, 20), (55.0, 6), (60.0, 6), (0.0, FEWEST)]
)
def test_no_repeat_is_begun_when_the_time_is_up(seconds: float, expected: int) -> None:
    now = 0.0

    def take_ten_seconds() -> None:
        nonlocal now
        now += 10

    results = repeated(20, "", take_ten_seconds, seconds=seconds, timer=lambda: now)
    assert len(results) == expected


def test_few_repeats_stay_few() -> None:
    assert len(repeated(2, "", lambda: None, seconds=0)) == 2


def test_what_is_warm_is_called_no_more_than_it_has_to_be() -> None:
    calls = count()
    assert repeated(20, "", lambda: next(calls), seconds=0, fewest=1, warm=True) == [0]
