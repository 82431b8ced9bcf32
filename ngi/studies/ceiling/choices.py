"""What the patches of a run are chosen by: their true errors, or what a sampler can know."""

# ruff: noqa: ARG002 - a choice is given more than it need look at

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import torch
from torch import Tensor

from ngi.explore import Importance
from ngi.explore.forest import grow
from ngi.explore.predicted_from_buffers import worth
from ngi.learn import disagreeing_relatively
from ngi.patches import Patches
from ngi.reuse import CompactPatches
from ngi.studies.ceiling.pool import chosen
from ngi.studies.ceiling.training import Training

CHUNK = 512
"""Candidates that the network is asked about at once."""


class Choice(Protocol):
    """Of one run: candidates are drawn by `importance` of their `values`."""

    importance: Importance

    def values(self, candidates: Tensor, count: int, generator: torch.Generator) -> Tensor:
        """[n], at least 0, of the patches with these numbers, of which `count` will be drawn."""
        ...

    def chose(self, numbers: Tensor) -> None:
        """These were chosen, and are not trained on yet."""
        return


class Oracle(Choice):
    """By true errors, under the present averaged weights.

    relative: as `Training.relative_errors` has them, in place of `Training.errors`
    truth: [m, h, w, 3] log1p radiance of the pool, see `Training.answers`
    """

    def __init__(
        self,
        importance: Importance,
        *,
        relative: bool = False,
        training: Training,
        pool: CompactPatches,
        truth: Tensor,
    ) -> None:
        self.importance = importance
        self._errors = training.relative_errors if relative else training.errors
        self._pool, self._truth = pool, truth

    def values(self, candidates: Tensor, count: int, generator: torch.Generator) -> Tensor:
        return errors_of(candidates, self._errors, pool=self._pool, truth=self._truth)


class Predicted(Choice):
    """As `PredictedFromBuffers` draws: by what is known of a patch before a path is traced.

    That is v, mean and deviation of its buffers and of the network's answer, and how far present
    and averaged weights disagree on it. The forest is grown through the losses of all chosen
    before, and what was known of them, as they were new.

    uniform_first: patches that are drawn uniformly before any are looked at
    candidates_per_patch: of the patches that are left, so many are looked at for each drawn
    truth: not looked at
    forest: trees, depth and smallest_leaf, see `ngi.explore.forest.grow`
    """

    def __init__(
        self,
        *,
        importance: Importance,
        uniform_first: int,
        candidates_per_patch: int,
        training: Training,
        pool: CompactPatches,
        truth: Tensor,
        **forest: int,
    ) -> None:
        self.importance = importance
        self._forest = forest
        self._training, self._pool = training, pool
        self._uniform_first = uniform_first
        self._per_patch = candidates_per_patch
        self._looked_at = torch.zeros(0, dtype=torch.int64)
        self._known = torch.zeros(0)  # of these
        self._seen: list[Tensor] = []
        self._losses: list[Tensor] = []

    @property
    def remembered(self) -> tuple[Tensor, Tensor]:
        """What was known of all patches chosen so far, [m, F], and their losses, [m]."""
        return torch.cat(self._seen), torch.cat(self._losses)

    def values(self, candidates: Tensor, count: int, generator: torch.Generator) -> Tensor:
        seen, losses = self.remembered
        if len(seen) < self._uniform_first:
            return torch.ones(len(candidates))
        forest = grow(seen, losses, generator, **self._forest)
        order = torch.randperm(len(candidates), generator=generator)
        places = order[: self._per_patch * count]
        self._looked_at = candidates[places]
        self._known = self._described(self._looked_at)
        values = torch.zeros(len(candidates))
        values[places] = worth(self._known, forest)
        return values

    def chose(self, numbers: Tensor) -> None:
        """Losses count relative to those of their round: later ones are lower."""
        parts = numbers.split(CHUNK)
        losses = torch.cat([self._training.losses(chosen(self._pool, part)) for part in parts])
        same = self._looked_at == numbers[:, None]
        looked_at = bool(same.any(dim=1).all())  # not where they were drawn uniformly
        known = self._known[same.int().argmax(dim=1)] if looked_at else self._described(numbers)
        self._seen.append(known)
        self._losses.append(losses / losses.mean())

    def _described(self, numbers: Tensor) -> Tensor:
        """[n, F]: the disagreement in units of its mean, as in runs that look."""
        parts = numbers.split(CHUNK)
        return disagreeing_relatively(
            torch.cat([self._training.described(chosen(self._pool, part)) for part in parts])
        )


def errors_of(
    numbers: Tensor,
    measure: Callable[[Patches, Tensor], Tensor],
    *,
    pool: CompactPatches,
    truth: Tensor,
) -> Tensor:
    """[n] what `measure` makes of the patches with these numbers and their truth."""
    parts = numbers.split(CHUNK)
    return torch.cat([measure(chosen(pool, part), truth[part]) for part in parts])
