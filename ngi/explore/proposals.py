"""Where the chains propose to go next (paper, Sec. 5, Eq. 2): large steps and small steps."""

# ruff: noqa: ARG002 - a distribution is given more than it need look at

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor


@dataclass(frozen=True)
class Proposals:
    """Proposed states of n chains.

    position: [n, S] float32 in [0, 1), the scene vector and then the patch position
    large_step: [n] bool, whether the proposal is independent of the chain's current state
    weight: [n] float32, factors of the losses that undo how likely each was; None for 1
    known: [n, F] float32, what was known of them when they were chosen; None where nobody asked
    """

    position: Tensor
    large_step: Tensor
    weight: Tensor | None = None
    known: Tensor | None = None


Describe = Callable[[Tensor], Tensor]
"""What is known of states [m, S] before paths are traced there, [m, F].

The last number, at least 0, is how far from settled the network is there, in units of their mean.
"""


def nothing_known(states: Tensor) -> Tensor:
    """The `Describe` of a run that has none: RuntimeError."""
    raise RuntimeError(f"{len(states)} states are to be described, and nobody said what by")


class ProposalDistribution(Protocol):
    """The proposal distribution T(u -> v), symmetric: T(u -> v) = T(v -> u)."""

    @property
    def starts_chains(self) -> bool:
        """Whether chains that hold no state begin at its proposals, or at uniformly drawn ones."""
        ...

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        """Proposes one new state for each of n chains at `position` [n, S], in [0, 1]^S.

        batch: how often the run has proposed before

        `generator` is on the device of `position`; how many numbers are drawn from it depends on
        the shape only.
        """
        ...


def wrap(position: Tensor) -> Tensor:
    """Takes any real coordinates onto the torus [0, 1)^S.

    A coordinate just below 0 is rounded to 1 (-1e-10 + 1 in float32), which on the torus is 0.
    """
    fraction = position - position.floor()
    return torch.where(fraction < 1, fraction, torch.zeros_like(fraction))


@dataclass(frozen=True, kw_only=True)
class NormalPerturbation(ProposalDistribution):
    """Small steps perturb every component by a normal variate (paper, Sec. 5.1).

    large_step_probability: probability that a chain jumps to a uniformly drawn state (paper,
        Sec. 5: 0.3); with 1 this is the uniform sampler
    standard_deviation: of every component's perturbation, in units of the hypercube's side

    The result is wrapped around at 0 and 1: reflecting at the border would be symmetric too, but
    clamping would not, and would pile up states on the border. The paper gives no standard
    deviation. The root mean square of the release's perturbation with its s1 = 1/25, s2 = 1/20,
    sqrt((s2^2 - s1^2) / (2 ln(s2 / s1))) = 0.0449, takes steps of the same size: use 0.045.
    """

    large_step_probability: float
    standard_deviation: float

    starts_chains = False

    def __post_init__(self) -> None:
        _check_probability(self.large_step_probability)
        if not 0 < self.standard_deviation < math.inf:
            raise ValueError(
                f"standard_deviation: {self.standard_deviation}: give a number above 0, in units "
                "of the unit hypercube's side"
            )

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        normal = torch.empty_like(position).normal_(generator=generator)
        return _mix(
            wrap(position + self.standard_deviation * normal),
            self.large_step_probability,
            generator,
        )


@dataclass(frozen=True, kw_only=True)
class ExponentialPerturbation(ProposalDistribution):
    """Small steps move every component by +-s2 exp(-ln(s2 / s1) xi), xi uniform in [0, 1).

    This is the release's perturbation, that of Kelemen et al. (2002), wrapped around at 0 and 1:
    the size of a component's step is between s1 = `smallest` and s2 = `largest` and its logarithm
    is uniform, so that with the release's 1/25 and 1/20 no component ever stays where it is. The
    paper has normal perturbations instead, see `NormalPerturbation`.

    large_step_probability: probability that a chain jumps to a uniformly drawn state
    smallest, largest: s1 and s2, in units of the hypercube's side
    """

    large_step_probability: float
    smallest: float
    largest: float

    starts_chains = False

    def __post_init__(self) -> None:
        _check_probability(self.large_step_probability)
        if not 0 < self.smallest <= self.largest <= 0.5:
            raise ValueError(
                f"smallest: {self.smallest}, largest: {self.largest}: give sizes with "
                "0 < smallest <= largest <= 0.5 (half way round the unit hypercube)"
            )

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        xi = torch.empty_like(position).uniform_(generator=generator)
        size = self.largest * torch.exp(-math.log(self.largest / self.smallest) * xi)
        forward = torch.empty_like(position).uniform_(generator=generator) < 0.5
        moved = position + torch.where(forward, size, -size)
        return _mix(wrap(moved), self.large_step_probability, generator)


def _mix(small: Tensor, large_step_probability: float, generator: torch.Generator) -> Proposals:
    """Replaces a chain's small step by a uniformly drawn state, with the given probability."""
    uniform = torch.empty_like(small).uniform_(generator=generator)
    large = (
        torch.rand(small.shape[0], generator=generator, device=small.device)
        < large_step_probability
    )
    return Proposals(position=torch.where(large[:, None], uniform, small), large_step=large)


def _check_probability(probability: float) -> None:
    if not 0 <= probability <= 1:
        raise ValueError(f"large_step_probability: {probability}: give a number in [0, 1]")
