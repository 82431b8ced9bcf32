"""Sizes that follow from budget and machine."""

import math
import os

import pytest
import torch

from ngi.config.configuration import composed
from ngi.machine.size import (
    bootstrap_batches,
    network_depth,
    network_width,
    usable_cores,
    warmup_steps,
)


@pytest.mark.parametrize(
    ("seconds", "batches"), [(1, 1), (15, 1), (30, 2), (60, 4), (75, 4), (3600, 4), (None, 4)]
)
def test_the_bootstrap_is_a_share_of_the_budget(seconds: float | None, batches: int) -> None:
    assert bootstrap_batches(seconds) == batches


@pytest.mark.parametrize("seconds", ["5m", math.inf, math.nan, [1], True])
def test_what_is_no_budget_is_for_others_to_refuse(seconds: object) -> None:
    assert 1 <= bootstrap_batches(seconds) <= 4


@pytest.mark.parametrize(
    ("steps", "warmup"), [(None, 30), (1400, 30), (120, 30), (119, 29), (31, 7), (12, 3), (1, 0)]
)
def test_the_warm_up_fits_into_the_budget(steps: int | None, warmup: int) -> None:
    assert warmup_steps(steps) == warmup
    assert (
        composed("method=ours", f"+budget.steps={steps or 'null'}").schedule.warmup_steps == warmup
    )


@pytest.mark.parametrize(("gpu", "size"), [(True, (8, 512)), (False, (6, 128))])
def test_a_gpu_gets_the_papers_network(
    gpu: bool, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: gpu)
    assert (network_depth("auto"), network_width("auto")) == size


def test_a_pinned_process_has_the_cores_it_is_pinned_to() -> None:
    every = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(every)})
        assert usable_cores() == 1
    finally:
        os.sched_setaffinity(0, every)
    assert usable_cores() == len(every)
