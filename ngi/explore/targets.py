"""What the chains look for: the target function f of a sample (paper, Sec. 5.1).

A target is the product of signals of a sample under the network's current weights, all at least 0.
Where a signal is NaN or infinite, so is the target; `MarkovChains.accept` deals with that.
"""

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor


@dataclass(frozen=True)
class Signals:
    """What the network says about n samples; what no target requires may be None.

    loss: [n], the training loss of the sample
    output_gradient_norm: [n], L2 norm of the loss's derivative by the network's output, over the
        pixels of the patch
    step_norm: [n], L2 norm over all weights of the optimiser's step this sample alone would cause,
        momentum and RMS included
    """

    loss: Tensor
    output_gradient_norm: Tensor | None = None
    step_norm: Tensor | None = None


class Target(Protocol):
    """The target function; its scale does not matter."""

    @property
    def requires(self) -> frozenset[str]:
        """The fields of `Signals` it reads, so that no other need be computed."""
        ...

    def __call__(self, signals: Signals) -> Tensor:
        """Target of each of n samples, [n], not negative; ValueError where a signal is missing."""
        ...


class Loss(Target):
    """The loss alone: the paper's ablation, in which chains stay where nothing can be learned."""

    requires = frozenset({"loss"})

    def __call__(self, signals: Signals) -> Tensor:
        return signals.loss


class LossTimesStep(Target):
    """Loss times the norm of the optimiser's total step for this sample (paper, Sec. 5.1)."""

    requires = frozenset({"loss", "step_norm"})

    def __call__(self, signals: Signals) -> Tensor:
        return signals.loss * _required(signals.step_norm, "step_norm")


class LossTimesOutputGradient(Target):
    """Loss times the norm of its derivative by the network's output.

    Not in the paper: it stands in for the step's norm at next to no cost, for it needs no backward
    pass through the network.
    """

    requires = frozenset({"loss", "output_gradient_norm"})

    def __call__(self, signals: Signals) -> Tensor:
        return signals.loss * _required(signals.output_gradient_norm, "output_gradient_norm")


class Constant(Target):
    """The same for every sample: for the uniform sampler, which looks at no target."""

    requires: frozenset[str] = frozenset()

    def __call__(self, signals: Signals) -> Tensor:
        return torch.ones_like(signals.loss)


def _required(signal: Tensor | None, name: str) -> Tensor:
    if signal is None:
        raise ValueError(f"the target needs the signal '{name}': let the scorer compute it")
    return signal
