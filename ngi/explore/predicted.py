"""Independent states, more of them where the loss is predicted to be high."""

# ruff: noqa: ARG002 - a sampler is given more than it need look at

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from ngi.explore.chains import ChainInfo, ChainState
from ngi.explore.forest import Forest, grow
from ngi.explore.importance import Importance
from ngi.explore.proposals import Describe, Proposals, nothing_known
from ngi.explore.targets import Constant

NEWER_SHARE = 1 / 8
"""Of the remembered states: when so many are newer than the forest, it is grown anew."""

SEEN_TOGETHER = 64
"""Losses that the network had as much training for, roughly."""

MOST_NUMBERS = 2**28
"""That a forest is grown from at once: a gigabyte, which is needed some four times."""


@dataclass(frozen=True)
class PredictedState(ChainState):
    """What the next states are predicted from, beside those that were drawn last.

    seen: [m, S], the newest states that were rendered, oldest first; [m, F] described
    loss: [m], what each lost when it was new: before the network was trained on it
    newer: [], how many were seen since the forest was grown
    feature, threshold, leaf: of the forest
    """

    seen: Tensor
    loss: Tensor
    newer: Tensor
    feature: Tensor
    threshold: Tensor
    leaf: Tensor

    @property
    def forest(self) -> Forest:
        """What losses are predicted by."""
        return Forest(self.feature, self.threshold, self.leaf)


class PredictedLoss:
    """A sampler without chains: every state is drawn anew, by the loss that is predicted there.

    Out of `candidates` uniform states n are drawn, without replacement, with the density that
    `importance` makes of their predicted losses. The prediction is a regression forest through the
    states that were rendered last and their losses as they were new, which is what states that the
    network has not met would lose: nothing is rendered for it, and the network is not asked. A
    forest serves until an eighth of what is remembered is newer; with a full memory that is what
    makes it cheap.

    chains: n, states in a batch
    candidates: per batch, at least n
    memory: states that are remembered; the losses of older ones are those of another network
    trees, depth, smallest_leaf: see `ngi.explore.forest.grow`
    Raises ValueError for numbers out of range.
    """

    needs_current = False
    needs_description = False
    patches_per_vector = 1

    def __init__(
        self,
        *,
        chains: int,
        candidates: int,
        importance: Importance,
        memory: int,
        trees: int,
        depth: int,
        smallest_leaf: int,
    ) -> None:
        for name, value, least in (
            ("chains", chains, 1),
            ("candidates", candidates, chains),
            ("memory", memory, 2 * chains),
            ("trees", trees, 1),
            ("depth", depth, 1),
            ("smallest_leaf", smallest_leaf, 1),
        ):
            if value < least:
                raise ValueError(f"sampler.{name}: {value}: give at least {least}")
        self.chains = chains
        self.target = Constant()
        self._seen_together = SEEN_TOGETHER
        self._grown_from = 2 * chains
        self._candidates = candidates
        self._importance = importance
        self._memory = memory
        self._forest = {"trees": trees, "depth": depth, "smallest_leaf": smallest_leaf}

    def init(self, state_dimensions: int) -> PredictedState:
        """See `MarkovChains.init`: nothing seen yet.

        Raises ValueError where a forest of so many variables would not fit into memory.
        """
        numbers = self._forest["trees"] * self._memory * state_dimensions
        if numbers > MOST_NUMBERS:
            raise ValueError(
                f"sampler.memory: {self._forest['trees']} trees of {self._memory} states with "
                f"{state_dimensions} variables take several times {4e-9 * numbers:.1f} GB of "
                "memory; lower sampler.memory or sampler.trees, or choose sampler=sobol"
            )
        forest = Forest.flat(trees=self._forest["trees"], depth=self._forest["depth"])
        return PredictedState.empty(
            self.chains,
            state_dimensions,
            seen=torch.zeros(0),
            loss=torch.zeros(0),
            newer=torch.tensor(0),
            feature=forest.feature,
            threshold=forest.threshold,
            leaf=forest.leaf,
        )

    def propose(
        self,
        state: PredictedState,
        generator: torch.Generator,
        *,
        batch: int,
        describe: Describe = nothing_known,
    ) -> Proposals:
        """A batch of states, uniform ones as long as fewer than 2 n were seen."""
        candidates, known, values = self._valued(state, batch, describe, generator)
        chosen, weights = self._importance.draw(values, self.chains, generator)
        return Proposals(
            position=candidates[chosen],
            large_step=torch.ones(self.chains, dtype=torch.bool),
            weight=weights.float() if self._importance.weighted else None,
            known=known[chosen],
        )

    def _valued(
        self,
        state: PredictedState,
        batch: int,
        describe: Describe,
        generator: torch.Generator,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Candidates of a batch [k, S], what is known of them [k, F], values [k]."""
        shape = self._candidates, state.position.shape[1]
        uniform = torch.empty(shape).uniform_(generator=generator)
        return uniform, uniform, state.forest(uniform)

    def accept(
        self,
        state: PredictedState,
        proposals: Proposals,
        patch_ids: Tensor,
        target_current: Tensor,
        target_proposed: Tensor,
        generator: torch.Generator,
        *,
        losses: Tensor,
    ) -> tuple[PredictedState, ChainInfo]:
        """Remembers the proposals' losses, [n]; those that are NaN or infinite are forgotten.

        Of any device; no gradient is kept.
        """
        assert proposals.known is not None
        losses = losses.detach().float().to(proposals.known.device)
        finite = losses.isfinite()
        seen = torch.cat([state.seen, proposals.known[finite]])[-self._memory :]
        loss = torch.cat([state.loss, losses[finite]])[-self._memory :]
        newer = state.newer + finite.sum()
        forest = state.forest
        if len(seen) >= self._grown_from and newer >= NEWER_SHARE * len(seen):
            forest = grow(seen, self._of_their_time(loss), generator, **self._forest)
            newer = torch.tensor(0)
        moved = replace(
            state,
            position=proposals.position,
            patch=patch_ids,
            age=torch.zeros_like(state.age),
            seen=seen,
            loss=loss,
            newer=newer,
            feature=forest.feature,
            threshold=forest.threshold,
            leaf=forest.leaf,
        )
        everywhere = torch.ones(self.chains, dtype=torch.bool)
        return moved, ChainInfo(everywhere, everywhere, ~state.occupied, moved.age)

    def _of_their_time(self, losses: Tensor) -> Tensor:
        """Each divided by the mean of those that were seen shortly before and after it, [m].

        A network loses less everywhere as it learns: without this the first states would look as
        if they were the worst until they are forgotten, which takes most of a run that reuses
        patches.
        """
        count = min(self._seen_together, len(losses))
        first = (torch.arange(len(losses)) - count // 2).clamp(0, len(losses) - count)
        mean = losses[first[:, None] + torch.arange(count)].mean(dim=1)
        return torch.where(mean > 0, losses / mean, 0.0)
