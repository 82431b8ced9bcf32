"""The step that Muon would take for one sample's gradient, were its normaliser left as it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import torch
from torch import Tensor

from ngi.models.adam_step import gradients_per_chunk

RMS = 0.2
"""Root mean square of an entry's change, per learning rate (`adjust_lr_fn='match_rms_adamw'`)."""


@dataclass(frozen=True)
class MuonStep:
    """What a sample would do to a weight matrix under `MuonAdam`, as a function of its gradient g.

    The exploration target asks how far a sample alone would move the network (paper, Sec. 5.1).
    Muon's true answer is the same for every sample: it orthogonalises U(g) = β²·B + (1 − β²)·g (B
    is the momentum so far, β its decay, with Nesterov's look ahead), and an orthogonal matrix has
    one norm, so that every step has the length 0.2·lr·√(rows·columns). That is no peculiarity of
    orthogonalisation: any step that is normalised by the very gradient it is made of says nothing
    about this gradient's size. Adam's is not: its normaliser is an average over a thousand steps,
    which one sample hardly changes. The same is done here: the normaliser stays that of the
    momentum, and

        ‖step(g)‖ = 0.2·lr·√(rows·columns) · ‖U(g)‖ / ‖B‖   (Frobenius norms).

    For g = B, a sample like the recent average, it is the length of Muon's true step; larger
    gradients, and those that agree with where the momentum goes, move the network further, as
    under Adam, in proportion to its learning rate and beside Adam's steps for the other parameters.
    Before the first step there is no momentum to compare with, and the norm is that of the true
    step for every sample.

    What it leaves out: that orthogonalisation makes rare directions as long as frequent ones (which
    would take a decomposition of every layer and two further products per sample), and clipping,
    which again would make all samples equal. The decrease of the loss along the step, ⟨g, step⟩,
    would be as cheap, but it is next to nothing for a sample whose gradient is at right angles to
    the momentum: just those that training has not met yet.
    """

    momentum: Tensor  # β²·B
    size: Tensor  # ‖B‖, []
    gain: float  # 1 − β²
    length: float  # of the true step

    @classmethod
    def of(cls, parameter: Tensor, group: Mapping[str, Any], state: Mapping[str, Any]) -> Self:
        """From the optimiser's parameter group and state, which is empty before the first step."""
        zero = torch.zeros_like(parameter, requires_grad=False)
        momentum = state.get("momentum_buffer", zero)
        kept = group["momentum"] ** 2
        return cls(
            momentum=momentum * kept,
            size=torch.linalg.vector_norm(momentum),
            gain=1 - kept,
            length=RMS * float(group["lr"]) * parameter.numel() ** 0.5,
        )

    def scaled(self, factor: float) -> Self:
        """The step for `factor` times the gradient, as a function of the gradient."""
        return replace(self, gain=self.gain * factor)

    def squared_norm(self, gradients: Tensor) -> Tensor:
        """‖step(g_i)‖² of n gradients [n, rows, columns], [n]."""
        chunks = gradients.split(gradients_per_chunk(self.momentum))
        norms = torch.cat([self._norm(g) for g in chunks])
        size = torch.where(self.size > 0, self.size, norms)
        tiny = torch.finfo(norms.dtype).tiny
        return (self.length * norms / size.clamp(min=tiny)).square()

    def _norm(self, g: Tensor) -> Tensor:
        update = torch.add(self.momentum, g, alpha=self.gain)
        norms: Tensor = torch.linalg.vector_norm(update.flatten(1), dim=1)
        return norms
