"""Whether a chain goes where it proposed to go (paper, Sec. 5.1, Eq. 3 and 4)."""

# ruff: noqa: ARG002 - a rule is given more than it need look at

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor


class Acceptance(Protocol):
    """The acceptance rule, given p, the targets of the proposed and of the current states."""

    @property
    def needs_current(self) -> bool:
        """Whether it looks at the targets; if not, the current states need no scoring."""
        return True

    def __call__(
        self, target_proposed: Tensor, target_current: Tensor, generator: torch.Generator
    ) -> Tensor:
        """[n] bool, whether each of n chains accepts; targets are [n], finite and not negative."""
        ...


@dataclass(frozen=True, kw_only=True)
class Greedy(Acceptance):
    """Accepts only what improves the target (paper, Sec. 5.1, Eq. 4): p(v) > p(u).

    The target of a state falls as the network learns from it, which is what lets a chain leave it.

    accept_equal: accept p(v) >= p(u), as the release does
    """

    accept_equal: bool

    needs_current = True

    def __call__(
        self,
        target_proposed: Tensor,
        target_current: Tensor,
        generator: torch.Generator,
    ) -> Tensor:
        if self.accept_equal:
            return target_proposed >= target_current
        return target_proposed > target_current


class Metropolis(Acceptance):
    """Accepts with probability min(1, p(v) / p(u)) (paper, Sec. 5.1, Eq. 3).

    A state of target 0 is left for any other, also for one of target 0, as a chain must not stay
    where the distribution has no mass.
    """

    needs_current = True

    def __call__(
        self, target_proposed: Tensor, target_current: Tensor, generator: torch.Generator
    ) -> Tensor:
        """Raises ValueError for a negative target."""
        if (target_proposed < 0).any() or (target_current < 0).any():
            raise ValueError(
                f"Metropolis acceptance: a target is negative (proposed "
                f"{target_proposed.tolist()}, current {target_current.tolist()}): use a target "
                "that is at least 0, or greedy acceptance"
            )
        xi = torch.rand(
            target_proposed.shape,
            generator=generator,
            dtype=torch.float64,
            device=target_proposed.device,
        )
        # Multiplied out, p(u) = 0 needs no division; xi < 1 makes p(v) >= p(u) certain.
        return (xi * target_current < target_proposed) | (target_current == 0)


class Always(Acceptance):
    """Accepts everything: with large steps only, the paper's uniform baseline (Sec. 7.2)."""

    needs_current = False

    def __call__(
        self,
        target_proposed: Tensor,
        target_current: Tensor,
        generator: torch.Generator,
    ) -> Tensor:
        return torch.ones_like(target_proposed, dtype=torch.bool)
