"""Which stored patches are trained on again, and how much their losses count."""

# ruff: noqa: ARG002 - a rule is given more than it need look at

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor


class DrawingRule(Protocol):
    """Draws from m stored patches, known by their slots 0 … m - 1; all tensors are on the CPU."""

    @property
    def by_loss(self) -> bool:
        """Whether it looks at the losses; if not, a GPU need not wait for them."""
        return True

    def draw(
        self, losses: Tensor, waiting: Tensor, count: int, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Slots drawn, [count] int64, and what the next call is to be given as `waiting`.

        losses: [m] float64, m > 0, the last recorded ones, finite and at least 0
        waiting: [k] int64, slots that are drawn next; none at the start of a run
        """
        ...

    def weights(self, losses: Tensor, slots: Tensor) -> Tensor | None:
        """[n] float64, the factors of n drawn patches' losses in the batch's mean; None for 1."""
        return None


class ProportionalToLoss(DrawingRule):
    """With replacement, in proportion to the last recorded loss (paper, Sec. 6.1).

    With all losses 0 every patch is as likely.
    """

    by_loss = True

    def draw(
        self, losses: Tensor, waiting: Tensor, count: int, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        return _draw_in_proportion(losses, count, generator), waiting


class Epochs(DrawingRule):
    """Without replacement: each patch once per epoch, in an order that is drawn for every epoch.

    A batch that reaches beyond the end of an epoch is filled up from the next one. Patches that
    were added come with the next epoch, in the place of those they replaced at once.
    """

    by_loss = False

    def draw(
        self, losses: Tensor, waiting: Tensor, count: int, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """`waiting` is the rest of the epoch."""
        while len(waiting) < count:
            waiting = torch.cat([waiting, torch.randperm(len(losses), generator=generator)])
        return waiting[:count], waiting[count:].clone()


@dataclass(frozen=True, kw_only=True)
class Prioritised(DrawingRule):
    """Prioritized experience replay, proportional (Schaul et al. 2016, Sec. 3.3 and 3.4).

    Patch i is drawn with probability P(i) = p_i^alpha / sum_j p_j^alpha, p_i = loss_i + epsilon,
    with replacement, and its loss counts w_i = (1 / m · 1 / P(i))^beta times, divided by the
    largest w of the batch. With beta = 1 that undoes P within a batch; batches count by their
    largest w, so that the mean over batches comes near to that of uniform draws, but is not it.

    alpha: 0 draws uniformly; the paper's proportional variant has 0.6
    beta: 0 corrects nothing. The paper goes from 0.4 to 1 in the course of the training; here it
        stays, as in Horgan et al. (2018), since a run need not know how long it will be
    epsilon: above 0, in units of the loss, so that what has been learnt is drawn at times
    """

    alpha: float
    beta: float
    epsilon: float

    by_loss = True

    def __post_init__(self) -> None:
        for name, value in (("alpha", self.alpha), ("beta", self.beta)):
            if not 0 <= value <= 1:
                raise ValueError(f"reuse.store.rule.{name}: {value}: give a number in [0, 1]")
        if not 0 < self.epsilon < math.inf:
            raise ValueError(f"reuse.store.rule.epsilon: {self.epsilon}: give a number above 0")

    def draw(
        self, losses: Tensor, waiting: Tensor, count: int, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        return _draw_in_proportion(self._priorities(losses), count, generator), waiting

    def weights(self, losses: Tensor, slots: Tensor) -> Tensor | None:
        # 1 / m and the sum of all priorities are the same for all patches of the batch.
        priorities = self._priorities(losses[slots])
        return (priorities.min() / priorities) ** self.beta

    def _priorities(self, losses: Tensor) -> Tensor:
        return (losses + self.epsilon) ** self.alpha


class Density(Protocol):
    """What `ByImportance` draws with, such as `ngi.explore.Importance`."""

    @property
    def weighted(self) -> bool:
        """Whether losses are weighted back to uniform draws."""
        ...

    def probabilities(self, values: Tensor) -> Tensor:
        """Of m patches with these losses, [m] float64 with sum 1."""
        ...

    def weights(self, probabilities: Tensor) -> Tensor:
        """[m] float64, factors of their losses."""
        ...


@dataclass(frozen=True)
class ByImportance(DrawingRule):
    """With replacement, with a density that is made of the last recorded losses.

    importance: the density, and the factors of the losses
    """

    importance: Density

    by_loss = True

    def draw(
        self, losses: Tensor, waiting: Tensor, count: int, generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        probabilities = self.importance.probabilities(losses)
        return _draw_in_proportion(probabilities, count, generator), waiting

    def weights(self, losses: Tensor, slots: Tensor) -> Tensor | None:
        if not self.importance.weighted:
            return None
        return self.importance.weights(self.importance.probabilities(losses))[slots]


def _draw_in_proportion(priorities: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """[count] int64 indices into `priorities` [m] float64, with replacement; uniform for all 0."""
    cumulative = priorities.cumsum(0)
    if cumulative[-1] < torch.finfo(torch.float64).tiny:
        return torch.randint(len(priorities), (count,), generator=generator)
    # rand < 1 keeps the product below the last element also after rounding (not for subnormal
    # numbers, hence `tiny`); right=True takes the first element above it, which is not 0.
    uniform = torch.rand(count, dtype=torch.float64, generator=generator) * cumulative[-1]
    return torch.searchsorted(cumulative, uniform, right=True)
