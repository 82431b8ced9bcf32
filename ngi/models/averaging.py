"""Averages of a network's weights over its last steps: less noise than the weights themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

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

    def average(averaged: list[Tensor], current: list[Tensor], steps: Tensor | int) -> None:
        count = int(made.n_averaged)  # `steps` is the same, on the weights' device
        kept = min(decay, (1 + count) / (10 + count))
        get_ema_multi_avg_fn(kept)(averaged, current, steps)

    made = _CountedByTheHost(network, multi_avg_fn=average)  # type: ignore[arg-type]
    return made.requires_grad_(False)


class _CountedByTheHost(AveragedModel):
    """The number of its steps stays on the CPU wherever its weights go.

    A GPU would be waited for three times a step.
    """

    def _apply(self, fn: Callable[[Tensor], Tensor], recurse: bool = True) -> Self:
        count = self.n_averaged
        super()._apply(fn, recurse)  # type: ignore[no-untyped-call]
        self.n_averaged = count
        return self
