"""Sizes that follow from budget and machine."""

import pytest
import torch

from ngi.machine.size import bootstrap_batches, network_depth, network_width


@pytest.mark.parametrize(
    ("seconds", "batches"), [(1, 1), (15, 1), (30, 2), (60, 4), (75, 4), (3600, 4), (None, 4)]
)
def test_the_bootstrap_is_a_share_of_the_budget(seconds: float | None, batches: int) -> None:
    assert bootstrap_batches(seconds) == batches


@pytest.mark.parametrize(("gpu", "size"), [(True, (8, 512)), (False, (6, 128))])
def test_a_gpu_gets_the_papers_network(
    gpu: bool, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: gpu)
    assert (network_depth(), network_width()) == size
