"""Asks the network for the target density of proposed and current chain states.

Scoring has to cost next to nothing (a sampler that spends a third of its time on it loses to
uniform sampling at equal time). The proposals are trained on anyway, so that their loss, the
output that their gradient there follows from, and the norm of their step are taken from the
training pass itself.
Only the chains' current states go through the network for it, all in one pass.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import fields

import torch
from torch import Tensor, nn

from ngi.clock.phase_clock import PhaseClock
from ngi.explore import Signals, Target
from ngi.learn.samples import Example
from ngi.models import (
    SampleLoss,
    output_gradient_norm,
    sample_step_norm,
    step_norms_in_backward,
)
from ngi.patches import Patches

Scores = tuple[Callable[[], Tensor], Tensor]
"""Target density of the proposals, [n], known once the backward pass is over, and of the chains'
current states, [n]."""


class Scorer:
    """Evaluates `target` under the present weights (paper, Sec. 5.1).

    example: see `Samples.example`
    """

    def __init__(
        self,
        *,
        target: Target,
        network: nn.Module,
        loss: SampleLoss,
        clock: PhaseClock,
        example: Callable[[Patches], Example],
    ) -> None:
        unknown = target.requires - {field.name for field in fields(Signals)}
        if unknown:
            raise ValueError(
                f"sampler.target: {type(target).__name__} requires {sorted(unknown)}; known are "
                f"{[field.name for field in fields(Signals)]}"
            )
        self.requires = target.requires
        self._target = target
        self._network = network
        self._loss = loss
        self._clock = clock
        self._example = example

    @contextmanager
    def watch(
        self, proposed: Patches, current: Patches, optimizer: torch.optim.Optimizer
    ) -> Iterator[Callable[[Tensor, Tensor], Scores]]:
        """Watches the forward pass of a training step on `proposed`, made inside the block.

        Gives a function of that pass's output [n, P, P, 3] and losses [n] for the scores. The
        training loss is the mean of these losses.
        """
        watched: AbstractContextManager[Callable[[], Tensor | None]] = nullcontext(lambda: None)
        if "step_norm" in self._target.requires:
            watched = step_norms_in_backward(
                self._network,
                optimizer,
                gradient_scale=len(proposed),
                around=lambda: self._clock.phase("score"),
            )
        with watched as step_norms:
            yield lambda output, losses: self._scores(
                proposed, current, optimizer, output, losses.detach(), step_norms
            )

    def _scores(
        self,
        proposed: Patches,
        current: Patches,
        optimizer: torch.optim.Optimizer,
        output: Tensor,
        losses: Tensor,
        step_norms: Callable[[], Tensor | None],
    ) -> Scores:
        with self._clock.phase("score"):
            gradients = self._output_gradients(output, self._example(proposed)[1])
            of_current = self._target(self.signals(current, optimizer))
        return lambda: self._target(Signals(losses, gradients, step_norms())), of_current

    def signals(self, patches: Patches, optimizer: torch.optim.Optimizer) -> Signals:
        """What the network says about [n] patches as they are: in a pass of their own."""
        losses = norms = gradients = None
        inputs, target = self._example(patches)
        if "step_norm" in self._target.requires:
            losses, norms = sample_step_norm(self._network, self._loss, optimizer, inputs, target)
        if losses is None or "output_gradient_norm" in self._target.requires:
            with torch.no_grad():
                output = self._network(*inputs)
                losses = self._loss(output, target)
            gradients = self._output_gradients(output, target)
        return Signals(losses, gradients, norms)

    def _output_gradients(self, output: Tensor, target: Tensor) -> Tensor | None:
        if "output_gradient_norm" not in self._target.requires:
            return None
        return output_gradient_norm(output, target, self._loss)
