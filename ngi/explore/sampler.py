"""What chooses the states that are rendered: Markov chains, or independent draws."""

from typing import Any, Protocol

import torch
from torch import Tensor

from ngi.explore.chains import ChainInfo
from ngi.explore.proposals import Describe, Proposals, nothing_known
from ngi.explore.targets import Target


class Sampler(Protocol):
    """Pure functions on a state of its own kind, a `ChainState` or derived from it."""

    chains: int
    """n, the number of patches in a generated batch."""
    target: Target

    @property
    def patches_per_vector(self) -> int:
        """How many patches of a batch, one after the other, have the same scene vector."""
        ...

    @property
    def needs_current(self) -> bool:
        """Whether the states where it stands have to be scored, too."""
        ...

    @property
    def needs_description(self) -> bool:
        """Whether `propose` asks what is known of states."""
        ...

    def init(self, state_dimensions: int) -> Any:
        """The state at the start of a run, for states of S = D + 2 dimensions."""
        ...

    def propose(
        self,
        state: Any,
        generator: torch.Generator,
        *,
        batch: int,
        describe: Describe = nothing_known,
    ) -> Proposals:
        """The n states to render next.

        batch: how often the run has proposed before
        describe: asked where `needs_description`
        """
        ...

    def accept(
        self,
        state: Any,
        proposals: Proposals,
        patch_ids: Tensor,
        target_current: Tensor,
        target_proposed: Tensor,
        generator: torch.Generator,
        *,
        losses: Tensor,
    ) -> tuple[Any, ChainInfo]:
        """The state once they are rendered: see `MarkovChains.accept`.

        losses: [n], the proposals' losses before the network was trained on them, without their
            noise where it is known; where `needs_description`, what the averaged weights are wrong
            about just after (`ngi.learn.Description.errors`)
        """
        ...
