from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from ngi.studies.benchmark import compilations, leaving_out, memory, overhead


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts work in this process instead of starting others, which takes seconds each."""

    @contextmanager
    def remote(make: Callable[[], Any], **_: Any) -> Iterator[Callable[..., Any]]:
        made = make()
        yield lambda function, *arguments, **options: function(made, *arguments, **options)

    for part in (compilations, leaving_out, memory, overhead):
        monkeypatch.setattr(part, "remote", remote)
