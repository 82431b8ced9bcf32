"""The forest: which splits its trees take, and what they find."""

import pytest
import torch
from scipy import stats

from ngi.explore.forest import PRIOR, grow


def test_a_single_split_is_that_of_its_formula() -> None:
    """Two groups: every threshold between them gives the same leaves, shrunk to the mean."""
    points = torch.tensor([[0.1], [0.11], [0.9], [0.91]])
    values = torch.tensor([1.0, 3.0, 10.0, 14.0])
    forest = grow(
        points, values, torch.Generator().manual_seed(0), trees=5, depth=1, smallest_leaf=2
    )
    low = (1 + 3 + PRIOR * 7) / (2 + PRIOR)
    high = (10 + 14 + PRIOR * 7) / (2 + PRIOR)
    found = forest(torch.tensor([[0.0], [0.1], [0.91], [1.0]]))
    assert found.tolist() == pytest.approx([low, low, high, high])


def test_few_variables_that_matter_are_found_among_many() -> None:
    generator = torch.Generator().manual_seed(1)
    points = torch.rand(1000, 30, generator=generator)
    test = torch.rand(1000, 30, generator=generator)

    def rare(states: torch.Tensor) -> torch.Tensor:
        return ((states[:, 3] > 0.7) & (states[:, 17] < 0.3)).float()

    forest = grow(points, rare(points), generator, trees=16, depth=6, smallest_leaf=3)
    truth = rare(test).bool()
    predicted = forest(test)
    order = stats.mannwhitneyu(predicted[truth], predicted[~truth]).statistic
    assert order / (truth.sum() * (~truth).sum()) > 0.95


def test_too_few_samples_are_not_split() -> None:
    points = torch.rand(5, 2, generator=torch.Generator().manual_seed(0))
    forest = grow(points, torch.arange(5.0), torch.Generator(), trees=3, depth=4, smallest_leaf=3)
    assert torch.allclose(forest(points), torch.full((5,), 2.0))


@pytest.mark.parametrize("mirrored", [False, True])
def test_sides_of_a_split_count_by_their_squared_errors_however_many_they_hold(
    mirrored: bool,
) -> None:
    """By the second variable, one point and three: no error, 6² / 1 + 6² / 3 = 48.

    By the first, two and two: 8² / 2 + 4² / 2 = 40, though 8² + 4² is more than 6² + 6².
    """
    points = torch.tensor([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 1.0]])
    values = torch.tensor([6.0, 2.0, 2.0, 2.0])
    forest = grow(
        1 - points if mirrored else points,
        values,
        torch.Generator().manual_seed(0),
        trees=3,
        depth=1,
        smallest_leaf=1,
    )
    assert forest.feature.tolist() == [[1]] * 3
