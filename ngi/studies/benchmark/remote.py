"""Objects in processes of their own, which are asked in turn and idle in between.

Dr.Jit cannot always record launches where another scene was loaded meanwhile, so that whatever is
compared with patches traces elsewhere; and what a fresh process compiles or keeps in memory needs a
fresh process.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from ngi.machine.child_process import end_with_parent
from ngi.machine.memory import keep_freed_memory

_made: list[Any] = []
"""What this process was started for, in a process that was."""


@contextmanager
def remote(
    make: Callable[[], object], *, environment: Mapping[str, str] | None = None
) -> Iterator[Callable[..., Any]]:
    """Gives a function that has a spawned process call a function of what `make` made there.

    It takes that function, which gets the object before its other arguments, and waits for the
    result. All of these have to be picklable; what is raised there is raised here.

    environment: variables that only that process has.
    """
    context = get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, initializer=end_with_parent) as pool:
        with _variables(environment or {}):
            made = pool.submit(_make, make)
        made.result()
        yield lambda *call, **options: pool.submit(_call, *call, **options).result()


def _make(make: Callable[[], object]) -> None:
    keep_freed_memory()
    _made.append(make())


def _call(function: Callable[..., object], *arguments: object, **options: object) -> object:
    return function(_made[0], *arguments, **options)


@contextmanager
def _variables(variables: Mapping[str, str]) -> Iterator[None]:
    """Sets environment variables, which a process started inside the block inherits."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
