"""The Markov chains that explore the data space (paper, Sec. 5): init, propose, accept.

`ChainState` is what the next step needs and is checkpointed, `ChainInfo` is for logs only.
"""

from dataclasses import dataclass, fields, replace
from typing import Self

import torch
from torch import Tensor

from ngi.explore.acceptance import Acceptance
from ngi.explore.proposals import Describe, ProposalDistribution, Proposals, nothing_known
from ngi.explore.targets import Target


@dataclass(frozen=True)
class ChainState:
    """Where n chains stand.

    position: [n, S] float32 in [0, 1], the scene vector and then the patch position; 0 for a chain
        that holds no state yet
    patch: [n] int64, id of the stored patch rendered at `position`, -1 for such a chain
    age: [n] int64, number of proposals made since the chain entered its state
    """

    position: Tensor
    patch: Tensor
    age: Tensor

    @classmethod
    def empty(cls, chains: int, state_dimensions: int, **more: Tensor) -> Self:
        """That of chains which hold no state yet. more: fields of a derived class"""
        if state_dimensions < 2:
            raise ValueError(
                f"state_dimensions: {state_dimensions}: give at least 2, for the patch position"
            )
        return cls(
            position=torch.zeros(chains, state_dimensions),
            patch=torch.full((chains,), -1),
            age=torch.zeros(chains, dtype=torch.int64),
            **more,
        )

    @property
    def occupied(self) -> Tensor:
        """[n] bool, whether the chain holds a state."""
        return self.patch >= 0

    def state_dict(self) -> dict[str, Tensor]:
        """The tensors, for a checkpoint."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_state_dict(cls, state: dict[str, Tensor]) -> Self:
        """Raises ValueError where `state` does not hold the tensors of a `ChainState`."""
        expected = [field.name for field in fields(cls)]
        if sorted(state) != sorted(expected):
            raise ValueError(
                f"checkpoint of the chains: it holds {sorted(state)} instead of "
                f"{sorted(expected)}: it was written by another version, start the run afresh"
            )
        return cls(**state)


@dataclass(frozen=True)
class ChainInfo:
    """What happened in one step of n chains, for logs.

    accepted: [n] bool
    large_step: [n] bool, whether the proposal was a large step
    initialised: [n] bool, whether the chain held no state before
    age: [n] int64, `ChainState.age` after the step
    """

    accepted: Tensor
    large_step: Tensor
    initialised: Tensor
    age: Tensor

    @property
    def acceptance_rate(self) -> float:
        """Accepted part of the proposals; NaN where no chain held a state to compare with."""
        return self._rate(~self.initialised)

    @property
    def large_step_acceptance_rate(self) -> float:
        """Accepted part of the large steps; NaN where there was none."""
        return self._rate(~self.initialised & self.large_step)

    @property
    def small_step_acceptance_rate(self) -> float:
        """Accepted part of the small steps; NaN where there was none."""
        return self._rate(~self.initialised & ~self.large_step)

    @property
    def mean_age(self) -> float:
        """Mean number of proposals since the chains entered their states."""
        return self.age.double().mean().item()

    def _rate(self, selected: Tensor) -> float:
        return self.accepted[selected].double().mean().item()


class MarkovChains:
    """A sampler: n chains with one proposal distribution, target and acceptance rule.

    chains: n, the number of chains and of patches in a generated batch (paper, Sec. 4: 16)

    All methods are pure; states and `generator` are on one device.
    """

    needs_description = False

    def __init__(
        self,
        *,
        chains: int,
        proposal: ProposalDistribution,
        target: Target,
        acceptance: Acceptance,
    ) -> None:
        if chains < 1:
            raise ValueError(f"chains: {chains}: give at least 1")
        self.chains = chains
        self.proposal = proposal
        self.target = target
        self.acceptance = acceptance

    @property
    def needs_current(self) -> bool:
        """Whether `accept` wants the current states' targets; if not, nothing need be scored."""
        return self.acceptance.needs_current

    @property
    def patches_per_vector(self) -> int:
        """What the proposal says; 1 where it says nothing."""
        number: int = getattr(self.proposal, "patches_per_vector", 1)
        return number

    def init(self, state_dimensions: int) -> ChainState:
        """Chains that hold no state yet; each enters the first one it proposes.

        state_dimensions: S = D + 2; raises ValueError below 2, and what the first batch would
            raise: some proposal distributions have no points for any number of chains or variables.
        """
        state = ChainState.empty(self.chains, state_dimensions)
        self.propose(state, torch.Generator(), batch=0)
        return state

    def propose(
        self,
        state: ChainState,
        generator: torch.Generator,
        *,
        batch: int,
        describe: Describe = nothing_known,  # noqa: ARG002 - chains know where they stand
    ) -> Proposals:
        """One proposal per chain; one that holds no state makes a large step (paper, Sec. 5).

        batch: how often the run has proposed before, proposals that were given up included
        """
        proposals = self.proposal.propose(state.position, generator, batch=batch)
        if self.proposal.starts_chains:
            return proposals
        start = torch.empty_like(state.position).uniform_(generator=generator)
        weight = proposals.weight
        return replace(
            proposals,
            position=torch.where(state.occupied[:, None], proposals.position, start),
            large_step=proposals.large_step | ~state.occupied,
            weight=None if weight is None else weight.where(state.occupied, 1.0),
            known=None,  # it is of the states that were not taken, too
        )

    def accept(
        self,
        state: ChainState,
        proposals: Proposals,
        patch_ids: Tensor,
        target_current: Tensor,
        target_proposed: Tensor,
        generator: torch.Generator,
        *,
        losses: Tensor | None = None,  # noqa: ARG002
    ) -> tuple[ChainState, ChainInfo]:
        """Each chain goes to its proposal or stays, as the acceptance rule says.

        patch_ids: [n] int64, ids of the stored patches of the proposals
        target_current, target_proposed: [n], of any device, both under the network's current
            weights; `target_current` is ignored where a chain holds no state, and everywhere
            where `needs_current` is False
        losses: not looked at, chains know targets only

        Two things come before the rule. A chain that holds no state accepts. And NaN or infinite
        targets neither win nor block: such a proposal is never accepted, and a chain whose current
        state has such a target accepts any proposal that has not.
        Raises ValueError for wrong lengths and negative ids.
        """
        proposed = self._per_chain("target_proposed", target_proposed, state).double()
        patch_ids = self._per_chain("patch_ids", patch_ids, state)
        if (patch_ids < 0).any():
            raise ValueError(f"patch_ids: {patch_ids.tolist()}: give the ids of stored patches")
        current = self._per_chain("target_current", target_current, state).double()
        comparable = proposed.isfinite()
        free = ~state.occupied | ~current.isfinite()
        chosen = self.acceptance(
            torch.where(comparable, proposed, 0.0), torch.where(free, 0.0, current), generator
        )
        accepted = comparable & (chosen | free)
        moved = ChainState(
            position=torch.where(accepted[:, None], proposals.position, state.position),
            patch=torch.where(accepted, patch_ids, state.patch),
            age=torch.where(accepted, 0, state.age + 1),
        )
        info = ChainInfo(
            accepted=accepted,
            large_step=proposals.large_step,
            initialised=~state.occupied,
            age=moved.age,
        )
        return moved, info

    def _per_chain(self, name: str, values: Tensor, state: ChainState) -> Tensor:
        if values.shape != (self.chains,):
            raise ValueError(
                f"{name}: shape {list(values.shape)}: give one value per chain, [{self.chains}]"
            )
        return values.detach().to(state.position.device)
