"""What stream and training step hand to each other, and what the stream counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from ngi.patches import Patches
from ngi.render.protocol import RenderedPatches


@dataclass(frozen=True)
class Batch:
    """One training batch.

    patches: [n] what is trained on: the proposals just rendered, or stored patches
    ids: [n] int64, their identities in the store
    generated: whether they were rendered for this batch
    current: [n] the chains' current states, to be scored beside the proposals; None where the
        acceptance rule does not look at them, on the first batch, and on reuse
    """

    patches: Patches
    ids: Tensor
    generated: bool
    current: Patches | None

    def to(self, device: torch.device | str) -> Batch:
        current = None if self.current is None else self.current.to(device)
        return Batch(self.patches.to(device), self.ids.to(device), self.generated, current)


@dataclass(frozen=True)
class Feedback:
    """What the training step learnt from a batch, all under the weights before that step.

    losses: [n] loss per sample
    target_proposed: [n] target density of the proposals, which the step's backward pass brings;
        None where nothing had to be scored
    target_current: [n] that of the chains' current states
    """

    losses: Tensor
    target_proposed: Callable[[], Tensor] | None
    target_current: Tensor | None


@dataclass
class Counters:
    """Running totals of a run; all are logged and checkpointed.

    scored_batches: generated batches for which the chains' current states were scored too
    batches_postponed: how often stored patches were trained on because new ones were not rendered
        yet (`TrainingStream`'s `when_late`)
    batches_refused: rendered batches that held NaN or Inf and were replaced by other proposals'
    steps_refused: steps not taken because the loss or its gradient was not finite (`StepGuard`)
    steps_scaled: steps whose gradient was scaled down, being far larger than the average
    """

    iteration: int = 0
    generated_batches: int = 0
    scored_batches: int = 0
    batches_postponed: int = 0
    patches_traced: int = 0
    paths_traced: int = 0
    patches_repaired: int = 0
    patches_masked: int = 0
    batches_refused: int = 0
    steps_refused: int = 0
    steps_scaled: int = 0

    def count_generated(self, rendered: RenderedPatches) -> None:
        """Adds one generated batch."""
        self.generated_batches += 1
        self.patches_traced += rendered.buffers.shape[:-3].numel()
        self.paths_traced += rendered.paths
        self.patches_repaired += rendered.repaired
        self.patches_masked += rendered.masked
