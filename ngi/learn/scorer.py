"""Asks the network for the target density of proposed and current chain states.

Scoring has to cost next to nothing (a sampler that spends a third of its time on it loses to
uniform sampling at equal time). The proposals are trained on anyway, so that their loss, their
gradient at the output and the norm of their Adam step are taken from the training pass itself.
Only the chains' current states go through the network for it, all in one pass.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import torch
from torch import Tensor, nn

from ngi.explore import Signals, Target
from ngi.learn.clock import PhaseClock
from ngi.models import (
    SampleLoss,
    adam_step_norm,
    output_gradient_norm,
    step_norms_in_backward,
)
from ngi.patches import Patches

Scores = tuple[Callable[[], Tensor], Tensor]
"""Target density of the proposals, [n], known once the backward pass is over, and of the chains'
current states, [n]."""


class Scorer:
    """Evaluates `target` under the present weights (paper, Sec. 5.1)."""

    def __init__(
        self, *, target: Target, network: nn.Module, loss: SampleLoss, clock: PhaseClock
    ) -> None:
        self._target = target
        self._network = network
        self._loss = loss
        self._clock = clock

    @contextmanager
    def watch(
        self, proposed: Patches, current: Patches, optimizer: torch.optim.Optimizer
    ) -> Iterator[Callable[[Tensor, Tensor], Scores]]:
        """Watches the forward pass of a training step on `proposed`, made inside the block.

        Gives a function of that pass's output [n, P, P, 3] and losses [n] for the scores. The
        training loss is the mean of these losses.
        """
        if "step_norm" not in self._target.requires:
            yield lambda output, losses: self._from_outputs(proposed, current, output, losses)
            return
        with step_norms_in_backward(
            self._network,
            optimizer,
            gradient_scale=len(proposed),
            around=lambda: self._clock.phase("score"),
        ) as step_norms:
            yield lambda _output, losses: self._from_adam_steps(
                current, optimizer, losses.detach(), step_norms
            )

    def _from_adam_steps(
        self,
        current: Patches,
        optimizer: torch.optim.Optimizer,
        proposed_losses: Tensor,
        proposed_norms: Callable[[], Tensor],
    ) -> Scores:
        with self._clock.phase("score"):
            losses, norms = adam_step_norm(
                self._network,
                self._loss,
                optimizer,
                current.buffers,
                current.scene_vector,
                current.log_radiance,
            )
            target = self._target(Signals(loss=losses, step_norm=norms))

        def of_proposed() -> Tensor:
            return self._target(Signals(loss=proposed_losses, step_norm=proposed_norms()))

        return of_proposed, target

    def _from_outputs(
        self, proposed: Patches, current: Patches, output: Tensor, losses: Tensor
    ) -> Scores:
        with self._clock.phase("score"):
            with torch.no_grad():
                current_output = self._network(current.buffers, current.scene_vector)
                current_losses = self._loss(current_output, current.log_radiance)
            of_proposed = self._evaluate(proposed, output, losses.detach())
            of_current = self._evaluate(current, current_output, current_losses)
        return lambda: of_proposed, of_current

    def _evaluate(self, patches: Patches, output: Tensor, losses: Tensor) -> Tensor:
        norms = None
        if "output_gradient_norm" in self._target.requires:
            norms = output_gradient_norm(output, patches.log_radiance, self._loss)
        return self._target(Signals(loss=losses, output_gradient_norm=norms))
