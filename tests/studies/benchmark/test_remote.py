import os

import pytest

from ngi.studies.benchmark.remote import remote


def add(made: list[int], number: int) -> tuple[int, list[int]]:
    made.append(number)
    return os.getpid(), made


def variable(_: object, name: str) -> str | None:
    return os.environ.get(name)


def fail(_: object) -> None:
    raise ValueError("the scene is too dark")


def test_an_object_lives_on_in_a_process_of_its_own() -> None:
    with remote(list, environment={"NGI_REMOTE": "there"}) as process:
        pid, _ = process(add, 1)
        assert pid != os.getpid()
        assert process(add, 2) == (pid, [1, 2])
        assert process(variable, "NGI_REMOTE") == "there"
        assert "NGI_REMOTE" not in os.environ
        with pytest.raises(ValueError, match="too dark"):
            process(fail)


def test_what_making_it_raises_is_raised_here() -> None:
    with pytest.raises(ZeroDivisionError), remote(divide):
        pass


def divide() -> float:
    return 1 / 0
