import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from ngi.render.direct_light import light_points
from ngi.render.tracing import derive_seed, of_centres, patch_window, subpixel_points


@given(st.integers(1, 70))
def test_subpixel_points_lie_in_the_pixel_and_are_spread(count) -> None:
    points = subpixel_points(count)
    assert points.shape == (count, 2)
    assert (points > 0).all()
    assert (points < 1).all()
    assert len(np.unique(points[:, 0])) == len(np.unique(points[:, 1])) == count


@pytest.mark.parametrize("count", [1, 2, 3, 5, 6, 16, 17, 64])
def test_points_average_to_the_centre(count) -> None:
    np.testing.assert_allclose(subpixel_points(count).mean(0), 0.5)
    np.testing.assert_allclose(light_points(count)[:, :5].mean(0), 0.5)


def test_sixteen_points_are_the_hammersley_set_in_its_cells_middle() -> None:
    """Hammersley 1960: (i / n, radical inverse of i in base 2)."""
    inverse = [int(f"{index:04b}"[::-1], 2) for index in range(16)]
    expected = (np.stack([np.arange(16), inverse], axis=1) + 0.5) / 16
    np.testing.assert_array_equal(subpixel_points(16), expected)


@pytest.mark.parametrize(("patch_size", "resolution"), [(32, 96), (16, 96), (32, 600), (5, 5)])
def test_centres_are_anywhere_in_the_image_and_patches_are_moved_into_it(
    patch_size, resolution
) -> None:
    """Between any two pixels, or at the border, as often as anywhere else."""
    centres = np.arange(resolution + 1)
    positions = torch.from_numpy((centres + 0.5) / (resolution + 1)).float()
    states = torch.stack([torch.full_like(positions, 0.3), positions, positions.flip(0)], dim=1)
    placed = of_centres(states, patch_size=patch_size, resolution=resolution)
    assert torch.equal(placed[:, 0], states[:, 0])
    windows = [
        patch_window(state[1:], patch_size=patch_size, resolution=resolution) for state in placed
    ]
    corners = np.clip(centres - patch_size // 2, 0, resolution - patch_size)
    assert [window.x for window in windows] == corners.tolist()
    assert [window.y for window in windows] == corners[::-1].tolist()
    inside = np.arange(resolution)[:, None]
    times = ((corners <= inside) & (inside < corners + patch_size)).sum(axis=1)
    assert (np.outer(times, times) >= np.outer(times, times).mean() / 4).all()


def test_positions_at_the_limits_are_in_the_image() -> None:
    states = torch.tensor([[0.0, 1.0], [1.0, 0.0]])
    placed = of_centres(states, patch_size=4, resolution=12)
    windows = [patch_window(state, patch_size=4, resolution=12) for state in placed]
    assert [(window.x, window.y) for window in windows] == [(0, 8), (8, 0)]


def test_positions_outside_the_image_are_refused() -> None:
    for position in (1.1, -0.1, float("nan")):
        with pytest.raises(ValueError, match=r"states\[0, 1\] is .*; expected 0 to 1"):
            of_centres(torch.tensor([[0.5, position, 0.5]]), patch_size=4, resolution=12)


def test_seeds_depend_on_every_part_and_their_limits() -> None:
    seeds = {derive_seed(1, b"ab", 2), derive_seed(2, b"ab", 2), derive_seed(1, b"a", 2)}
    seeds |= {derive_seed(1, b"ab", 3), derive_seed(1, b"a", b"b2"), derive_seed(12, b"ab")}
    assert len(seeds) == 6
    assert all(0 <= seed < 2**32 for seed in seeds)
    assert derive_seed(1, b"ab", 2) == derive_seed(1, b"ab", 2)
