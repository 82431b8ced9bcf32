"""Densities in proportion to what is to be gained, never far below a uniform one."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class Importance:
    """A defensive mixture over m candidates (Hesterberg 1995): of uniform and of valued ones,

        p_i = α / m + (1 - α) · value_i^power / Σ_j value_j^power,

    and what exceeds R / m of it goes to the others, in proportion to what each lacks of R / m.

    uniform_share: α, in [0, 1]; 1 is the uniform density. As p_i >= α / m, no weight of single
        draws exceeds 1 / α; those of several together scatter with how long the draw takes
    power: of the values, above 0
    largest_ratio: R, at least 1; no candidate is drawn more than so many times as often as by
        uniform draws. Without it a single one that holds most of the value would get most of 1 - α
    weighted: whether losses are weighted back to uniform candidates; else what is drawn often
        counts often
    Raises ValueError for numbers outside these ranges, and for weights without a bound (α = 0).
    """

    uniform_share: float
    power: float = 1.0
    largest_ratio: float = math.inf
    weighted: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.uniform_share <= 1:
            raise ValueError(f"uniform_share: {self.uniform_share}: give a number in [0, 1]")
        if not 0 < self.power < math.inf:
            raise ValueError(f"power: {self.power}: give a number above 0")
        if not self.largest_ratio >= 1:
            raise ValueError(f"largest_ratio: {self.largest_ratio}: give a number of at least 1")
        if self.weighted and self.uniform_share == 0:
            raise ValueError(
                "uniform_share: 0 with weighted: true: the weights would be unbounded; give a "
                "share above 0, whose inverse roughly bounds the weights"
            )

    def probabilities(self, values: Tensor) -> Tensor:
        """Of m candidates, [m] float64 with sum 1.

        values: [m], at least 0; those that are NaN or infinite count as 0, and where all are 0 the
        density is uniform. Raises ValueError for negative ones.
        """
        values = torch.where(values.isfinite(), values, 0.0).double()
        if (values < 0).any():
            raise ValueError(f"values: {values.min().item()} is among them: give at least 0")
        uniform = torch.full_like(values, 1 / len(values))
        largest = values.max()
        if largest == 0:
            return uniform
        valued = (values / largest) ** self.power
        mixed = self.uniform_share * uniform + (1 - self.uniform_share) * valued / valued.sum()
        return self._bounded(mixed)

    def _bounded(self, probabilities: Tensor) -> Tensor:
        """No entry above R / m, and their sum as it was: [m] to [m]."""
        largest = self.largest_ratio / len(probabilities)
        bounded = probabilities.clamp(max=largest)
        excess = (probabilities - bounded).sum()
        room = largest - bounded
        if excess == 0 or room.sum() <= 0:  # all at the bound, but for rounding
            return probabilities
        return bounded + excess * room / room.sum()

    def weights(self, probabilities: Tensor) -> Tensor:
        """1 / (m p_i) where `weighted`, else 1: factors of the losses of draws with replacement,
        [m] float64.
        """
        if not self.weighted:
            return torch.ones_like(probabilities)
        return 1 / (len(probabilities) * probabilities)

    def draw(self, values: Tensor, count: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """`count` different candidates, [count] int64, and their weights, [count] float64.

        Where `weighted`, the weighted mean over them has the mean over all candidates as its
        expectation: n / (m π_i) of n draws, where π_i is the probability that i comes before the
        first that was not drawn (Cohen and Kaplan 2007, rank conditioning), or to be drawn, where
        that is known. Raises ValueError for more than there are. Where fewer than `count` have any
        value, the rest is drawn from the others.
        """
        if count > len(values):
            raise ValueError(f"count: {count}: there are only {len(values)} candidates")
        probabilities = self.probabilities(values)
        # The largest of p_i / Exponential(1) are drawn without replacement (Efraimidis 2006).
        clocks = torch.empty_like(probabilities).exponential_(generator=generator)
        speeds = probabilities.clamp(min=1e-300).log() - clocks.log()
        chosen = speeds.topk(count).indices
        if not self.weighted or count == 1 or probabilities.min() == probabilities.max():
            return chosen, self.weights(probabilities)[chosen]
        if count == len(values):
            return chosen, torch.ones_like(probabilities)
        end = (-speeds.topk(count + 1).values[-1]).exp()  # when the next one would come
        included = -torch.expm1(-probabilities[chosen] * end)
        return chosen, count / (len(values) * included)
