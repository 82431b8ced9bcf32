"""A regression forest: what a value is, on average, where samples of it are near."""

from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor

PRIOR = 2.0
"""Samples of the overall mean that every leaf holds beside its own."""


@dataclass(frozen=True)
class Forest:
    """T trees of `depth` levels; node k, the root being 0, has the children 2 k + 1 and 2 k + 2.

    Points at or above a node's threshold go to its second child; a node that does not split has the
    threshold infinity.

    feature: [T, 2^depth - 1] int64; threshold: [T, 2^depth - 1]
    leaf: [T, 2^depth], mean value
    """

    feature: Tensor
    threshold: Tensor
    leaf: Tensor

    @classmethod
    def flat(cls, *, trees: int, depth: int) -> Self:
        """One that knows nothing: 1 everywhere."""
        nodes = 2**depth - 1
        return cls(
            feature=torch.zeros(trees, nodes, dtype=torch.int64),
            threshold=torch.full((trees, nodes), torch.inf),
            leaf=torch.ones(trees, nodes + 1),
        )

    def __call__(self, points: Tensor) -> Tensor:
        """Mean of the trees' values at n points [n, S], [n]."""
        inner = self.feature.shape[1]
        node = torch.zeros(len(self.leaf), len(points), dtype=torch.int64)
        for _ in range((inner + 1).bit_length() - 1):
            coordinate = points.T.gather(0, self.feature.gather(1, node))
            node = 2 * node + 1 + (coordinate >= self.threshold.gather(1, node))
        return self.leaf.gather(1, node - inner).mean(dim=0)


def grow(
    points: Tensor,
    values: Tensor,
    generator: torch.Generator,
    *,
    trees: int,
    depth: int,
    smallest_leaf: int,
) -> Forest:
    """Extremely randomised trees (Geurts et al. 2006) through all samples.

    A node tries one threshold per variable, drawn between the least and the largest of its samples,
    and takes the one that lowers the squared error most, as long as both children hold
    `smallest_leaf` samples. Few variables that matter are so found among many that do not.

    points: [m, S] with m > 0; values: [m], finite
    """
    columns = points.T  # [S, m]
    # Of every tree one after the other, [T m, S]. Rows are added up twice as fast as single numbers
    # are, in the same order.
    samples = points.repeat(trees, 1)
    of_tree = torch.arange(trees)[:, None]
    node = torch.zeros(trees, len(points), dtype=torch.int64)
    features, thresholds = [], []
    for level in range(depth):
        nodes = 2**level
        index = (node + nodes * of_tree).view(-1, 1).expand(samples.shape)  # in which node each is
        threshold = _thresholds(samples, index, trees, nodes, generator)  # [T, S, nodes]
        gain = _gains(samples, index, values, node, threshold, smallest_leaf)
        best, feature = gain.max(dim=1)  # [T, nodes]
        chosen = threshold.gather(1, feature[:, None])[:, 0]
        chosen = torch.where(best > -torch.inf, chosen, torch.inf)
        coordinate = columns.gather(0, feature.gather(1, node))
        node = 2 * node + (coordinate >= chosen.gather(1, node))
        features.append(feature)
        thresholds.append(chosen)
    count, total = _sums(values, node, 2**depth)
    mean = (total + PRIOR * values.mean()) / (count + PRIOR)
    return Forest(torch.cat(features, dim=1), torch.cat(thresholds, dim=1), mean)


def _thresholds(
    samples: Tensor, index: Tensor, trees: int, nodes: int, generator: torch.Generator
) -> Tensor:
    """[T, S, nodes] between the samples of each node; NaN or infinite in an empty one."""
    empty = samples.new_full((trees * nodes, samples.shape[1]), torch.inf)
    low = _of_trees(empty.scatter_reduce(0, index, samples, "amin"), nodes)
    high = _of_trees((-empty).scatter_reduce(0, index, samples, "amax"), nodes)
    return low + (high - low) * torch.rand(low.shape, generator=generator)


def _gains(
    samples: Tensor,
    index: Tensor,
    values: Tensor,
    node: Tensor,
    threshold: Tensor,
    smallest_leaf: int,
) -> Tensor:
    """[T, S, nodes]: sum²/count over both children, -inf where one is too small."""
    trees, dimensions, nodes = threshold.shape
    thresholds = threshold.transpose(1, 2).reshape(trees * nodes, dimensions)
    right = (samples >= thresholds[index[:, 0]]).to(values)
    zero = torch.zeros_like(thresholds)
    count_right = _of_trees(zero.scatter_add(0, index, right), nodes)
    right *= values.repeat(trees)[:, None]
    sum_right = _of_trees(zero.scatter_add(0, index, right), nodes)
    count, total = (sums[:, None] for sums in _sums(values, node, nodes))
    count_left, sum_left = count - count_right, total - sum_right
    gain = sum_left**2 / count_left + sum_right**2 / count_right
    fits = (count_left >= smallest_leaf) & (count_right >= smallest_leaf)
    return torch.where(fits, gain, -torch.inf)


def _of_trees(rows: Tensor, nodes: int) -> Tensor:
    """[T, S, nodes] of one row [S] for each node of each tree."""
    return rows.view(-1, nodes, rows.shape[1]).transpose(1, 2)


def _sums(values: Tensor, node: Tensor, nodes: int) -> tuple[Tensor, Tensor]:
    """Number and sum of the values in each node, [T, nodes]."""
    zero = values.new_zeros(len(node), nodes)
    spread = values.expand(len(node), -1)
    return zero.scatter_add(1, node, torch.ones_like(spread)), zero.scatter_add(1, node, spread)
