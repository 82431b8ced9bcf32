"""The passes of a training step as one CUDA graph."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import torch
from torch import Tensor, nn

from ngi.learn.samples import Example
from ngi.machine.captured import Captured
from ngi.models import SampleLoss


class CapturedPass:
    """Forward and backward pass of steps that score nothing, recorded once (`Captured`).

    The graph ends where the host may have to know the losses: the guard decides whether the step is
    taken. The optimiser's step is not part of it, since its learning rate, which changes from step
    to step, is a number of the host's, and would be recorded with it.

    network, loss: see `ngi.learn.Learner`
    precision: the context that the network computes in
    """

    def __init__(
        self,
        network: nn.Module,
        loss: SampleLoss,
        *,
        precision: Callable[[], AbstractContextManager[Any]],
    ) -> None:
        self._network = network
        self._loss = loss
        self._precision = precision
        self._parameters = list(network.parameters())
        self._passes = Captured(self._taken, module=network, name="training steps")

    def __call__(self, example: Example, loss_weights: Tensor | None) -> tuple[Tensor, Tensor]:
        """Losses [n] and their weighted mean [], whose gradient the parameters have then.

        All of it holds until the next call.
        """
        inputs, target = example
        if loss_weights is None:
            loss_weights = torch.ones(len(target), device=target.device)
        losses, loss, *gradients = self._passes(target, loss_weights, *inputs)
        for parameter, gradient in zip(self._parameters, gradients, strict=True):
            parameter.grad = gradient  # the guard may have dropped it
        return losses, loss

    def _taken(self, target: Tensor, loss_weights: Tensor, *inputs: Tensor) -> tuple[Any, ...]:
        for parameter in self._parameters:
            parameter.grad = None
        with self._precision():
            losses = self._loss(self._network(*inputs), target)
            loss = (losses * loss_weights).mean()
        loss.backward()
        return losses.detach(), loss.detach(), *(p.grad for p in self._parameters)
