from collections.abc import Iterator

import pytest

from tests.gpu.machine import pretended_gpu
from tests.gpu.pretended import Ledger


@pytest.fixture
def muon_rounds_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the pretended GPU and on a processor, also where that has no units for bfloat16."""
    monkeypatch.setattr("ngi.models.batched_muon.multiplies_bfloat16", lambda _: True)


@pytest.fixture
def gpu() -> Iterator[Ledger]:
    """A pretended GPU is there while the test lasts."""
    with pretended_gpu() as ledger:
        yield ledger
