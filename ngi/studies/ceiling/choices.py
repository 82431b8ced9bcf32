"""What the patches of a run are chosen by: their true errors, or what a sampler can know."""

# ruff: noqa: ARG002 - a choice is given more than it need look at

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor

from ngi.explore import Importance
from ngi.explore.forest import grow
from ngi.explore.predicted import worth
from ngi.reuse import CompactPatches
from ngi.studies.ceiling.pool import chosen
from ngi.studies.ceiling.training import Training

CHUNK = 512
"""Candidates that the network is asked about at once."""


class Choice(Protocol):
    """Of one run: candidates are drawn by `importance` of their `values`."""

    importance: Importance

    def values(self, candidates: Tensor, generator: torch.Generator) -> Tensor:
        """[n], at least 0, of the patches with these numbers."""
        ...

    def chose(self, numbers: Tensor) -> None:
        """These were chosen, and are not trained on yet."""
        return


class Oracle(Choice):
    """By true errors, under the present averaged weights.

    truth: [m, h, w, 3] log1p radiance of the pool, see `Training.answers`
    """

    def __init__(
        self, importance: Importance, *, training: Training, pool: CompactPatches, truth: Tensor
    ) -> None:
        self.importance = importance
        self._training, self._pool, self._truth = training, pool, truth

    def values(self, candidates: Tensor, generator: torch.Generator) -> Tensor:
        return true_errors(self._training, self._pool, self._truth, candidates)


class Predicted(Choice):
    """As `PredictedFromBuffers` draws: by what is known of a patch before a path is traced.

    That is v, mean and deviation of its buffers, and how far present and averaged weights disagree
    on it. The forest is grown through the losses of all chosen before as they were new.

    trees, depth, smallest_leaf: see `ngi.explore.forest.grow`
    """

    def __init__(
        self,
        *,
        importance: Importance,
        trees: int,
        depth: int,
        smallest_leaf: int,
        training: Training,
        pool: CompactPatches,
    ) -> None:
        self.importance = importance
        self._forest = {"trees": trees, "depth": depth, "smallest_leaf": smallest_leaf}
        self._training, self._pool = training, pool
        self._seen: list[Tensor] = []
        self._losses: list[Tensor] = []

    def values(self, candidates: Tensor, generator: torch.Generator) -> Tensor:
        seen = _known(self._training, self._pool, torch.cat(self._seen))
        forest = grow(seen, torch.cat(self._losses), generator, **self._forest)
        return worth(_known(self._training, self._pool, candidates), forest)

    def chose(self, numbers: Tensor) -> None:
        """Losses count relative to those of their round: later ones are lower."""
        parts = numbers.split(CHUNK)
        losses = torch.cat([self._training.losses(chosen(self._pool, part)) for part in parts])
        self._seen.append(numbers)
        self._losses.append(losses / losses.mean())


def _known(training: Training, pool: CompactPatches, numbers: Tensor) -> Tensor:
    """[n, F] of patches by their numbers."""
    parts = numbers.split(CHUNK)
    return torch.cat([training.described(chosen(pool, part)) for part in parts])


def true_errors(
    training: Training, pool: CompactPatches, truth: Tensor, candidates: Tensor
) -> Tensor:
    """[n] of the patches with these numbers, under the averaged weights."""
    parts = candidates.split(CHUNK)
    return torch.cat([training.errors(chosen(pool, part), truth[part]) for part in parts])
