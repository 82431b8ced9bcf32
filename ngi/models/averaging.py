"""Averages of a network's weights over its last steps: less noise than the weights themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel

Averaging = Callable[[nn.Module], AveragedModel | None]
"""Makes the averaged copy of a network, to be updated after every step; None for no average."""


def no_average(network: nn.Module) -> None:  # noqa: ARG001
    """The paper evaluates the weights as they are."""
    return


def exponential_average(network: nn.Module, *, decay: float) -> AveragedModel:
    """The average that keeps the share `decay` of itself at each step; at first it keeps less.

    After t steps it keeps min(decay, (1 + t) / (10 + t)), so that early on the initial weights
    do not stay in it: it goes back about a tenth of the steps so far, and with 0.98 never more than
    50. At the end of a decaying learning rate it changes next to nothing; before, it takes 10 to
    30 % off the error and the jumps off its curve. It costs one pass over the weights a step.

    decay: at least 0 (no average), below 1; ValueError otherwise
    """
    if not 0 <= decay < 1:
        raise ValueError(f"averaging.decay: {decay}; expected at least 0, below 1")
    return _ExponentialAverage(network, decay=decay).requires_grad_(False)


class _ExponentialAverage(AveragedModel):
    """Its number of steps stays on the CPU wherever its weights go, and is asked for there.

    PyTorch's own step has a GPU waited for: four times, or once with the number on the CPU.
    """

    def __init__(self, network: nn.Module, *, decay: float) -> None:
        super().__init__(network)
        self._decay = decay

    @torch.no_grad()
    def update_parameters(self, model: nn.Module) -> None:
        """Takes the weights after a step into the average, and the buffers as they are."""
        steps = int(self.n_averaged)
        averages: list[Tensor] = [*self.parameters()]
        weights: list[Tensor] = [*model.parameters()]
        if steps == 0:
            torch._foreach_copy_(averages, weights)
        else:
            kept = min(self._decay, (1 + steps) / (10 + steps))
            torch._foreach_lerp_(averages, weights, 1 - kept)
        for averaged, buffer in zip(self.module.buffers(), model.buffers(), strict=True):
            averaged.copy_(buffer)
        self.n_averaged += 1

    def _apply(self, fn: Callable[[Tensor], Tensor], recurse: bool = True) -> Self:
        count = self.n_averaged
        super()._apply(fn, recurse)  # type: ignore[no-untyped-call]
        self.n_averaged = count
        return self
