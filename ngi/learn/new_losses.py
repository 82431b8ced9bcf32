"""What patches lost when the network first met them, and how few of them lost most of it."""

import torch
from torch import Tensor

from ngi.evaluate.evaluation import WORST_OF
from ngi.learn.noise import without_noise

REMEMBERED = 1024

FEWEST = 20
"""Patches of which 5 % are at least one: what a part of the largest says is chance."""


class NewLosses:
    """The losses of the newest patches, at most `REMEMBERED`, each before it was trained on.

    Without noise, where that is known.
    """

    def __init__(self) -> None:
        self._losses = torch.zeros(0)

    def add(self, losses: Tensor, noise: Tensor | None) -> Tensor:
        """Remembers those of [n] that are neither NaN nor infinite; gives all, without noise.

        noise: [n], as from `ngi.learn.noise.noise_loss`, or None
        """
        if noise is not None:
            losses = without_noise(losses, noise)
        self._losses = torch.cat([self._losses, losses[losses.isfinite()]])[-REMEMBERED:]
        return losses

    @property
    def worst_share(self) -> float | None:
        """Of the newer half of them, see `worst_share`; None of fewer than `FEWEST`, or all 0.

        The older half may be that of a network which had not learnt anything yet.
        """
        newer = self._losses[len(self._losses) // 2 :]
        return worst_share(newer) if len(newer) >= FEWEST and newer.any() else None

    def state_dict(self) -> list[float]:
        return self._losses.tolist()

    def load_state_dict(self, state: list[float]) -> None:
        self._losses = torch.tensor(state)


def worst_share(losses: Tensor) -> float:
    """Part of the sum of losses [n] that the largest 5 % of them make.

    0.05 where all are equal; NaN where there are none, and where all are 0.
    """
    losses = losses.double().sort(descending=True).values
    counts = (len(losses) / WORST_OF - torch.arange(len(losses))).clamp(0, 1)  # the last in part
    return ((counts * losses).sum() / losses.sum()).item()
