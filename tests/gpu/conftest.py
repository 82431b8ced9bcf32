from collections.abc import Iterator

import pytest

from tests.gpu.machine import pretended_gpu
from tests.gpu.pretended import Ledger


@pytest.fixture
def gpu() -> Iterator[Ledger]:
    """A pretended GPU is there while the test lasts."""
    with pretended_gpu() as ledger:
        yield ledger
