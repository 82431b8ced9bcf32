"""What stream and training step hand to each other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from ngi.patches import Patches, uploaded

ENDLESS = 2**31
"""The length of a stream, in batches."""


@dataclass(frozen=True)
class Batch:
    """One training batch.

    patches: [n] what is trained on: the proposals just rendered, or stored patches
    ids: [n] int64, their identities in the store
    generated: whether they were rendered for this batch
    current: [n] the chains' current states, to be scored beside the proposals; None where the
        acceptance rule does not look at them, on the first batch, and on reuse
    loss_weights: [n] factors of the samples' losses in the batch's mean; None for 1
    first_half: of newly rendered patches, where the renderer gives it: see `RenderedPatches`
    """

    patches: Patches
    ids: Tensor
    generated: bool
    current: Patches | None
    loss_weights: Tensor | None = None
    first_half: Tensor | None = None

    def to(self, device: torch.device | str) -> Batch:
        """See `Patches.to`; the identities stay where they are."""
        return replace(
            self,
            patches=self.patches.to(device),
            current=None if self.current is None else self.current.to(device),
            loss_weights=None if self.loss_weights is None else uploaded(self.loss_weights, device),
            first_half=None if self.first_half is None else uploaded(self.first_half, device),
        )


@dataclass(frozen=True)
class Feedback:
    """What the training step learnt from a batch, all under the weights before that step.

    losses: [n] loss per sample, without weights
    target_proposed: [n] target density of the proposals; None where nothing had to be scored
    target_current: [n] that of the chains' current states
    noise: [n] what a network that knew the truth would lose; None where nobody can tell
    """

    losses: Tensor
    target_proposed: Tensor | None
    target_current: Tensor | None
    noise: Tensor | None = None
