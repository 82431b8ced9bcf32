"""The learning rate over a run, against closed forms and PyTorch's schedulers."""

import math
from pathlib import Path
from typing import Any

import pytest
import torch

from ngi.learn import Budget, ConstantRate, WarmupStableDecay
from ngi.models.batched_muon import BatchedMuon
from ngi.train import train
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED
from tests.learn.noted_rates import noted_rates

pytestmark = IGNORED


def schedule(**changed: Any) -> WarmupStableDecay:
    return WarmupStableDecay(
        **{"warmup_steps": 4, "decay_share": 0.5, "final_factor": 0.02, **changed}
    )


def factors(of: WarmupStableDecay, steps: int) -> list[float]:
    return [of.factor(steps=k, used=k / steps) for k in range(steps)]


def test_the_papers_rate_is_constant() -> None:
    constant = ConstantRate()
    assert constant.factor(steps=3, used=0.9) == 1
    assert not constant.decays(1.0)
    constant.check(Budget(steps=1))


def test_it_rises_stays_and_falls() -> None:
    found = factors(schedule(), 40)
    assert found[:4] == [0.25, 0.5, 0.75, 1]
    assert set(found[4:21]) == {1}
    expected = [0.02 + 0.98 * (1 + math.cos(math.pi * k / 20)) / 2 for k in range(20)]
    assert found[20:] == pytest.approx(expected)
    assert schedule().factor(steps=40, used=1.0) == pytest.approx(0.02)
    assert schedule().factor(steps=41, used=1.3) == pytest.approx(0.02)


@pytest.mark.parametrize("warmup", [0, 8])
def test_over_the_whole_budget_it_is_pytorchs_cosine(warmup: int) -> None:
    """Times the warm-up."""
    rising = [*((k + 1) / 8 for k in range(warmup)), *[1.0] * (30 - warmup)]
    optimizer = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=1.0)
    theirs = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, T_max=30, eta_min=0.02)
    ours = factors(schedule(warmup_steps=warmup, decay_share=1.0), 30)
    for found, warm in zip(ours, rising, strict=True):
        assert found == pytest.approx(warm * optimizer.param_groups[0]["lr"])
        optimizer.step()
        theirs.step()


def test_until_the_decay_a_run_is_the_beginning_of_a_longer_one() -> None:
    one, other = factors(schedule(), 40), factors(schedule(), 100)
    stable = [not schedule().decays(k / 40) for k in range(40)]
    assert stable == [True] * 20 + [False] * 20
    assert one[:20] == other[:20]
    assert one[22] != other[22]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"warmup_steps": -1}, "schedule.warmup_steps: -1"),
        ({"decay_share": 0.0}, "schedule.decay_share: 0.0"),
        ({"decay_share": 1.1}, "schedule.decay_share: 1.1"),
        ({"final_factor": -0.1}, "schedule.final_factor: -0.1"),
        ({"final_factor": 2.0}, "schedule.final_factor: 2.0"),
    ],
)
def test_numbers_out_of_range_are_named(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        schedule(**changed)


def test_a_schedule_longer_than_the_budget_is_refused() -> None:
    with pytest.raises(ValueError, match=r"schedule\.warmup_steps: 4 .*budget\.steps: 4"):
        schedule().check(Budget(steps=4))
    schedule().check(Budget(steps=5))
    schedule().check(Budget(seconds=1))


@pytest.mark.parametrize(
    ("optimizer", "base"),
    [
        (("optimizer=adam", "optimizer.lr=0.002"), {"Adam": 0.002}),
        (
            ("optimizer=muon", "optimizer.lr=0.004", "optimizer.adam_lr=0.002"),
            {"BatchedMuon": 0.004, "Adam": 0.002},
        ),
    ],
    ids=["adam", "muon"],
)
def test_every_step_is_taken_at_its_rate_and_the_clocks_share_decides(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    optimizer: tuple[str, ...],
    base: dict[str, float],
) -> None:
    noted = {
        rule.__name__: noted_rates(rule, monkeypatch) for rule in (torch.optim.Adam, BatchedMuon)
    }
    config = configuration(
        tmp_path,
        *optimizer,
        "schedule=warmup_stable_decay",
        "schedule.warmup_steps=4",
        "schedule.decay_share=0.5",
        "evaluation.count=1",
    )
    train(config)
    of_schedule = factors(schedule(), 40)
    rates = {rule: of_steps for rule, of_steps in noted.items() if of_steps}
    assert rates.keys() == base.keys()
    for rule, rate in base.items():
        assert rates[rule] == pytest.approx([rate * factor for factor in of_schedule])
