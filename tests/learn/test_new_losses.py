"""How concentrated the losses of new patches are, against closed forms and NumPy."""

import math

import numpy as np
import pytest
import torch

from ngi.learn.new_losses import REMEMBERED, NewLosses, worst_share


def test_equal_losses_are_not_concentrated_and_a_single_one_is() -> None:
    for count in (1, 20, 21, 39, 40):
        assert worst_share(torch.full((count,), 0.3)) == pytest.approx(0.05)
    assert worst_share(torch.eye(1, 40)[0]) == 1
    assert math.isnan(worst_share(torch.zeros(40)))
    assert math.isnan(worst_share(torch.zeros(0)))


def test_exponential_losses_have_the_share_that_the_integral_says() -> None:
    quantiles = (torch.arange(100_000, dtype=torch.float64) + 0.5) / 100_000
    # Of an exponential distribution: p (1 - ln p) for the largest p of all.
    share = 0.05 * (1 - math.log(0.05))
    assert worst_share(-(1 - quantiles).log()) == pytest.approx(share, rel=1e-3)


def test_of_fewer_than_twenty_nothing_is_said() -> None:
    """One of eight is no twentieth: runs of seconds said that a third of the loss is rare."""
    found = NewLosses()
    found.add(torch.full((38,), 0.3), None)
    assert found.worst_share is None
    found.add(torch.full((1,), 0.3), None)
    assert found.worst_share == pytest.approx(0.05)


def test_the_newer_half_of_what_is_remembered_counts() -> None:
    found = NewLosses()
    assert found.worst_share is None
    found.add(torch.zeros(40), None)
    assert found.worst_share is None
    losses = np.random.default_rng(3).lognormal(size=1500).astype(np.float32)
    losses[REMEMBERED // 2 : 600] = 1000  # of an untrained network, old by now
    for part in np.array_split(losses, 100):
        found.add(torch.from_numpy(part), None)
        found.add(torch.tensor([math.nan, math.inf]), None)
    newest = np.sort(losses[-REMEMBERED // 2 :])  # 512, of which 5 % are 25.6
    expected = (newest[-25:].sum() + 0.6 * newest[-26]) / newest.sum()
    assert found.worst_share == pytest.approx(expected, rel=1e-5)
