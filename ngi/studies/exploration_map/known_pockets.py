"""A sampler that knows where the rare is: what finding it could gain, whoever finds it."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from ngi.explore import Proposals
from ngi.render import PocketRenderer


@dataclass(frozen=True, kw_only=True)
class KnownPockets:
    """The `ngi.explore.ProposalDistribution` of uniform states, a share of them in the pockets.

    share: of the states that is drawn from the boxes of the pockets, uniformly
    weighted: whether losses are weighted back to uniform states
    """

    renderer: PocketRenderer
    share: float
    weighted: bool

    starts_chains = True

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:  # noqa: ARG002
        """See `ProposalDistribution.propose`."""
        states = torch.empty_like(position).uniform_(generator=generator)
        there = torch.rand(len(position), generator=generator) < self.share
        inside = self.renderer.into_pockets(states[:, :-2])
        states[:, :-2] = torch.where(there[:, None], inside, states[:, :-2])
        return Proposals(
            position=states,
            large_step=torch.ones(len(position), dtype=torch.bool),
            weight=1 / self._density(states[:, :-2]) if self.weighted else None,
        )

    def _density(self, scene_vectors: Tensor) -> Tensor:
        """[n], relative to uniform states."""
        volume = self.renderer.pockets * self.renderer.side**self.renderer.active
        boxes = self.renderer.boxes(scene_vectors)
        density: Tensor = 1 - self.share + self.share * boxes / volume
        return density
