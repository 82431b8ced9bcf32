"""Averaged weights against the recursion, written out in NumPy."""

import numpy as np
import pytest
import torch
from torch import nn

from ngi.models import exponential_average, no_average


def test_it_is_the_exponential_average_that_forgets_its_beginning() -> None:
    network = nn.Linear(3, 2)
    average = exponential_average(network, decay=0.6)
    generator = torch.Generator().manual_seed(0)
    expected = None
    for step in range(30):
        with torch.no_grad():
            for p in network.parameters():
                p.copy_(torch.randn(p.shape, generator=generator))
        average.update_parameters(network)
        weights = network.weight.detach().numpy().astype(np.float64)
        kept = 0 if step == 0 else min(0.6, (1 + step) / (10 + step))
        expected = weights if expected is None else kept * expected + (1 - kept) * weights
        np.testing.assert_allclose(average.module.weight.numpy(), expected, rtol=1e-5, atol=1e-6)
    assert kept == 0.6


def test_the_copy_is_neither_trained_nor_shared() -> None:
    network = nn.Linear(3, 2)
    average = exponential_average(network, decay=0.98)
    assert not any(p.requires_grad for p in average.parameters())
    assert all(p.requires_grad for p in network.parameters())
    average.update_parameters(network)
    before = average.module.weight.clone()
    with torch.no_grad():
        network.weight.zero_()
    assert torch.equal(average.module.weight, before)


def test_no_decay_is_the_weights_themselves() -> None:
    network = nn.Linear(3, 2)
    average = exponential_average(network, decay=0)
    for _ in range(3):
        with torch.no_grad():
            network.weight.add_(1)
        average.update_parameters(network)
    assert torch.equal(average.module.weight, network.weight)


def test_the_paper_averages_nothing() -> None:
    assert no_average(nn.Linear(1, 1)) is None


@pytest.mark.parametrize("decay", [-0.1, 1.0, float("nan")])
def test_a_decay_out_of_range_is_named(decay: float) -> None:
    with pytest.raises(ValueError, match=r"averaging\.decay"):
        exponential_average(nn.Linear(1, 1), decay=decay)
