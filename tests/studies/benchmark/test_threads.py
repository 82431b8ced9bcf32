from contextlib import nullcontext

import pytest

from ngi.studies.benchmark import threads


def test_both_in_turn_are_compared_with_the_sum_of_each_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = iter([(9.0, 9.0, 9.0), (1.0, 3.0, 4.4), (2.0, 2.0, 4.0), (1.0, 1.0, 4.0)])
    monkeypatch.setattr(threads, "NETWORKS", ((16, 3),))
    monkeypatch.setattr(threads, "remote", lambda _: nullcontext(lambda _: next(answers)))
    share, render, step, both = threads.alternation(repeats=3)
    assert share.median == pytest.approx(1.1)
    assert [render.median, step.median, both.median] == [1e3, 2e3, 4e3]


def test_each_is_timed_alone_and_then_both_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []

    class Recorded:
        def __init__(self, *_: object, **__: object) -> None:
            pass

        def render(self) -> None:
            calls.append("r")

        def step(self) -> None:
            calls.append("s")

    monkeypatch.setattr(threads, "ROUNDS", 2)
    monkeypatch.setattr(threads, "Batches", Recorded)
    monkeypatch.setattr(threads, "Training", Recorded)
    assert len(threads.Turns(16, 3, bf16=False).seconds()) == 3
    assert "".join(calls) == "rr" + "ss" + "rsrs"
