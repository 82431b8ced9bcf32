"""Asks the network for the target density of proposed and current chain states.

Scoring has to cost next to nothing (method notes, probes): the proposals are trained on anyway,
so whatever the training pass already holds (loss, gradient at the output) is taken from it, and
all chains go through one vectorised pass for the rest.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ngi.explore import Signals, Target
from ngi.learn.stream import Batch
from ngi.models import SampleLoss, adam_step_norm, output_gradient_norm
from ngi.patches import Patches


class Scorer:
    """Evaluates `target` for a generated batch under the present weights (paper, Sec. 5.1)."""

    def __init__(self, *, target: Target, network: nn.Module, loss: SampleLoss) -> None:
        self._target = target
        self._network = network
        self._loss = loss

    def __call__(
        self, batch: Batch, prediction: Tensor, losses: Tensor, optimizer: torch.optim.Optimizer
    ) -> tuple[Tensor, Tensor]:
        """Target density of the proposals and of the current states, each [n].

        prediction: [n, P, P, 3] the training pass's output for the proposals, graph attached
        losses: [n] its loss per sample
        """
        if batch.current is None:
            raise ValueError("this batch has no current chain states to score")
        if "step_norm" in self._target.requires:
            return self._from_adam_step(batch, optimizer)
        proposed = self._from_output(prediction, batch.patches, losses)
        with torch.no_grad():
            output = self._network(batch.current.buffers, batch.current.scene_vector)
        current = self._from_output(output.detach().requires_grad_(), batch.current, None)
        return proposed, current

    def _from_adam_step(
        self, batch: Batch, optimizer: torch.optim.Optimizer
    ) -> tuple[Tensor, Tensor]:
        assert batch.current is not None
        both = Patches.concatenate([batch.patches, batch.current])
        losses, norms = adam_step_norm(
            self._network, self._loss, optimizer, both.buffers, both.scene_vector, both.log_radiance
        )
        target = self._target(Signals(loss=losses, step_norm=norms))
        return target[: len(batch.patches)], target[len(batch.patches) :]

    def _from_output(self, output: Tensor, patches: Patches, losses: Tensor | None) -> Tensor:
        norms = None
        if "output_gradient_norm" in self._target.requires:
            norms = output_gradient_norm(output, patches.log_radiance, self._loss)
        if losses is None:
            with torch.no_grad():
                losses = self._loss(output, patches.log_radiance)
        return self._target(Signals(loss=losses.detach(), output_gradient_norm=norms))
