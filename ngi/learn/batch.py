"""What stream and training step hand to each other."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from ngi.patches import Patches


@dataclass(frozen=True)
class Batch:
    """One training batch.

    patches: [n] what is trained on: the proposals just rendered, or stored patches
    ids: [n] int64, their identities in the store
    generated: whether they were rendered for this batch
    current: [n] the chains' current states, to be scored beside the proposals; None where the
        acceptance rule does not look at them, on the first batch, and on reuse
    loss_weights: [n] factors of the samples' losses in the batch's mean; None for 1
    """

    patches: Patches
    ids: Tensor
    generated: bool
    current: Patches | None
    loss_weights: Tensor | None = None

    def to(self, device: torch.device | str) -> Batch:
        current = None if self.current is None else self.current.to(device)
        weights = None if self.loss_weights is None else self.loss_weights.to(device)
        return Batch(self.patches.to(device), self.ids.to(device), self.generated, current, weights)


@dataclass(frozen=True)
class Feedback:
    """What the training step learnt from a batch, all under the weights before that step.

    losses: [n] loss per sample, without weights
    target_proposed: [n] target density of the proposals; None where nothing had to be scored
    target_current: [n] that of the chains' current states
    """

    losses: Tensor
    target_proposed: Tensor | None
    target_current: Tensor | None
