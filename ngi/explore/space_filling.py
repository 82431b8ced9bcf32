"""States spread more evenly than uniform draws, whatever the network says: to compare with.

Neither looks at where a chain stands; with `Always` the chains go from batch to batch.
"""

# ruff: noqa: ARG002 - a distribution is given more than it need look at

import torch
from torch import Tensor
from torch.quasirandom import SobolEngine

from ngi.explore.proposals import ProposalDistribution, Proposals

QUARTERS = torch.tensor([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])
"""From one patch position to those of the same scene vector, as shares of the positions' range."""


class SobolSequence:
    """A scrambled Sobol sequence, of which any stretch can be had.

    Direction numbers of Joe and Kuo (2008), scrambled by random linear maps and a digital shift
    (Matousek 1998), as PyTorch does it.

    seed: the run's. The scrambling is seeded with a number drawn from it: seeded with the same one,
        PyTorch's sequences of all dimensions begin with the same point, and the run whose seed is
        that of the test frames (`ngi.evaluate.evaluation_frames`) would be trained on the first.
    """

    def __init__(self, *, seed: int) -> None:
        generator = torch.Generator().manual_seed(seed)
        self._seed = int(torch.randint(2**31, (), generator=generator))
        self._engine: SobolEngine | None = None  # kept to save time, nothing else

    def points(self, first: int, count: int, dimensions: int) -> Tensor:
        """Those from number `first` on, [count, dimensions] float32 in [0, 1).

        Raises ValueError for more than 21,201 dimensions.
        """
        if dimensions > SobolEngine.MAXDIM:
            raise ValueError(
                f"sampler: {dimensions} dimensions (the scene's variables and the patch position): "
                f"Sobol sequences exist for at most {SobolEngine.MAXDIM}; choose "
                "sampler=latin_hypercube"
            )
        if self._engine is None or self._engine.dimension != dimensions:
            self._engine = SobolEngine(dimensions, scramble=True, seed=self._seed)
        skipped = first - self._engine.num_generated
        if skipped < 0:
            self._engine.reset()
            skipped = first
        if skipped > 0:
            self._engine.fast_forward(skipped)
        return _single_precision(self._engine.draw(count, dtype=torch.float64))

    def quarters(self, first: int, count: int, dimensions: int) -> Tensor:
        """Four for each of `points`, [4 count, dimensions]: the same v, four patch positions.

        They are half the positions' range apart, beyond 1 they begin at 0: one is in each quarter.
        """
        states = self.points(first, count, dimensions).repeat_interleave(len(QUARTERS), dim=0)
        states[:, -2:] = (states[:, -2:] + QUARTERS.repeat(count, 1)) % 1
        return states


class Sobol(ProposalDistribution):
    """A `SobolSequence`: batch b of n points holds its points n b to n (b + 1) - 1.

    Which points a batch gets depends on its number alone, so that there is no place in the sequence
    that a checkpoint would have to hold.

    seed: the run's
    """

    starts_chains = True

    def __init__(self, *, seed: int) -> None:
        self._sequence = SobolSequence(seed=seed)

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        """Nothing is drawn from `generator`. Raises ValueError for more than 21,201 dimensions."""
        count, dimensions = position.shape
        return _large_steps(self._sequence.points(batch * count, count, dimensions), position)


class SobolQuarters(Sobol):
    """As `Sobol`, with four patch positions of each scene vector, `SobolSequence.quarters`.

    A scene is set up, and its photons are traced, for each scene vector and not for each patch: a
    batch of small patches, a quarter of the pixels each, takes about as long as one of as many
    scene vectors with large ones, and sees more of each.
    """

    patches_per_vector = len(QUARTERS)

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        """Nothing is drawn from `generator`. ValueError for n that is no multiple of 4."""
        patches, dimensions = position.shape
        vectors, rest = divmod(patches, len(QUARTERS))
        if rest:
            raise ValueError(
                f"sampler.chains: {patches}: give a multiple of {len(QUARTERS)}, the number of "
                "patches that share a scene vector"
            )
        return _large_steps(self._sequence.quarters(batch * vectors, vectors, dimensions), position)


class LatinHypercube(ProposalDistribution):
    """n points of which every variable has one in each of n equal intervals (McKay et al. 1979).

    Each batch is such a set by itself. One set of all patches of a run would be spread more evenly
    still, but how many they are is known at its end only, and part of a set promises nothing; any
    number of batches has equally many points in each of the n intervals.
    """

    starts_chains = True

    def propose(self, position: Tensor, generator: torch.Generator, *, batch: int) -> Proposals:
        keys, offset = torch.empty(
            (2, *position.shape), dtype=torch.float64, device=position.device
        ).uniform_(generator=generator)
        interval = keys.argsort(dim=0)  # of each variable a permutation of its own
        return _large_steps(_single_precision((interval + offset) / len(position)), position)


def _large_steps(points: Tensor, like: Tensor) -> Proposals:
    return Proposals(
        position=points.to(like),
        large_step=torch.ones(len(points), dtype=torch.bool, device=like.device),
    )


def _single_precision(points: Tensor) -> Tensor:
    """Float64 in [0, 1) rounded down, so that none becomes 1, or changes its cell of 2^k."""
    return ((points * 2**24).floor() / 2**24).float()
