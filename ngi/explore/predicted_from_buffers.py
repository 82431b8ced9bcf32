"""States drawn by what is seen of them before they are rendered, where rendering is dear."""

import math
from typing import Any

import torch
from torch import Tensor

from ngi.explore.forest import Forest
from ngi.explore.importance import Importance
from ngi.explore.predicted import PredictedLoss, PredictedState
from ngi.explore.proposals import Describe
from ngi.explore.space_filling import QUARTERS, SobolSequence


def worth(known: Tensor, forest: Forest) -> Tensor:
    """[m] of states of which [m, F] is `known`, the last number the network's disagreement there.

    The predicted loss times the root of the disagreement: where that is high the network is still
    learning, while a loss can be high by what it never learns.
    """
    return forest(known) * known[:, -1].sqrt()


class PredictedFromBuffers(PredictedLoss):
    """`PredictedLoss` where patches are dear, so that there is time to look before one is traced.

    The forest is grown through what `describe` tells of the states (of a run: buffers, v, and how
    far the network's present and averaged weights disagree) in place of the states themselves, and
    they are drawn by `worth`.

    What sets a scene up for one patch shows others of the same v, too: candidates are groups of
    four that differ in the patch position. Of each group at most one is rendered: patches of one v
    are much alike, and where few can be had that is what they are not to be. For the same reason
    the groups are points of a Sobol sequence over v and patch position, and their patches are half
    the positions' range apart, one in each quarter of it.

    A network that has learnt next to nothing does not tell what is worth learning: at first states
    are taken as they come in that sequence.

    seed: the run's
    candidates: per batch, at least 4 n, and a multiple of 4
    uniform_first: states that are taken as they come before any are chosen; they have to be
        remembered, and the first forest is grown through them
    importance: without weights, for of patches chosen in two steps they are not known
    """

    needs_description = True

    def __init__(
        self,
        *,
        seed: int,
        chains: int,
        candidates: int,
        importance: Importance,
        memory: int,
        uniform_first: int,
        **others: Any,
    ) -> None:
        super().__init__(
            chains=chains, candidates=candidates, importance=importance, memory=memory, **others
        )
        of_one_vector = len(QUARTERS)
        least = chains * of_one_vector
        if candidates % of_one_vector or candidates < least:
            raise ValueError(
                f"sampler.candidates: {candidates}: give a multiple of {of_one_vector} and "
                f"at least {least}: {of_one_vector} candidates share a scene vector"
            )
        if importance.weighted:
            raise ValueError("sampler.importance.weighted: true: no weights here; give false")
        if not 2 * chains <= uniform_first <= memory:
            raise ValueError(
                f"sampler.uniform_first: {uniform_first}: give at least {2 * chains}, and at most "
                f"sampler.memory, which is {memory}"
            )
        self._vectors = candidates // of_one_vector
        self._seen_together = 2 * chains
        self._grown_from = uniform_first
        self._sequence = SobolSequence(seed=seed)

    def init(self, state_dimensions: int) -> PredictedState:
        """Raises ValueError for more dimensions than there are Sobol sequences for."""
        self._sequence.points(0, 1, state_dimensions)
        return super().init(state_dimensions)

    def _valued(
        self,
        state: PredictedState,
        batch: int,
        describe: Describe,
        generator: torch.Generator,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """One of each group, after those that are taken as they come."""
        earlier, dimensions = self._points_before(batch), state.position.shape[1]
        if len(state.seen) < self._grown_from:
            first = self._sequence.points(earlier, self.chains, dimensions)
            return first, describe(first), torch.ones(self.chains)
        candidates = self._sequence.quarters(earlier, self._vectors, dimensions)
        known = describe(candidates)
        values = worth(known, state.forest)
        best = self._one_of_each(values.view(-1, len(QUARTERS)), generator)
        return candidates[best], known[best], values[best]

    def _points_before(self, batch: int) -> int:
        """How many of the sequence earlier batches had."""
        looked_at = max(0, batch - math.ceil(self._grown_from / self.chains))
        return (batch - looked_at) * self.chains + looked_at * self._vectors

    def _one_of_each(self, values: Tensor, generator: torch.Generator) -> Tensor:
        """[g] candidates, one of each group, drawn by their values [g, k]."""
        first = torch.arange(0, values.numel(), values.shape[1])
        drawn = [self._importance.draw(group, 1, generator)[0] for group in values]
        return first + torch.cat(drawn)
