"""What patches lost when the network first met them, and how few of them lost most of it."""

import math

import torch
from torch import Tensor

REMEMBERED = 1024


class NewLosses:
    """The losses of the newest patches, at most `REMEMBERED`, each before it was trained on.

    Without noise, where that is known (`ngi.learn.noise`).
    """

    def __init__(self) -> None:
        self._losses = torch.zeros(0)

    def add(self, losses: Tensor) -> None:
        """[n], on the CPU; those that are NaN or infinite are left out."""
        self._losses = torch.cat([self._losses, losses[losses.isfinite()]])[-REMEMBERED:]

    @property
    def worst_share(self) -> float:
        """Of the newer half of them, see `worst_share`; NaN before there are any.

        The older half may be that of a network which had not learnt anything yet.
        """
        return worst_share(self._losses[len(self._losses) // 2 :])

    def state_dict(self) -> Tensor:
        return self._losses

    def load_state_dict(self, state: Tensor) -> None:
        self._losses = state


def worst_share(losses: Tensor) -> float:
    """Part of the sum of losses [n] that the largest 5 % of them make.

    0.05 where all are equal; NaN where there are none, and where all are 0.
    """
    losses = losses.double()
    worst = losses.topk(math.ceil(len(losses) / 20)).values
    return (worst.sum() / losses.sum()).item()
