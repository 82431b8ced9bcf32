"""Which splits a tree of the forest takes."""

import pytest
import torch

from ngi.explore.forest import grow


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
