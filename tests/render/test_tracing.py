import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ngi.render.tracing import derive_seed, subpixel_points


@given(st.integers(1, 70))
def test_subpixel_points_lie_in_the_pixel_and_are_spread(count) -> None:
    points = subpixel_points(count)
    assert points.shape == (count, 2)
    assert (points > 0).all()
    assert (points < 1).all()
    assert len(np.unique(points[:, 0])) == len(np.unique(points[:, 1])) == count


def test_a_power_of_two_of_points_averages_to_the_centre() -> None:
    for count in (1, 2, 16, 64):
        np.testing.assert_allclose(subpixel_points(count).mean(0), 0.5)


def test_seeds_depend_on_every_part_and_their_limits() -> None:
    seeds = {derive_seed(1, b"ab", 2), derive_seed(2, b"ab", 2), derive_seed(1, b"a", 2)}
    seeds |= {derive_seed(1, b"ab", 3), derive_seed(1, b"a", b"b2"), derive_seed(12, b"ab")}
    assert len(seeds) == 6
    assert all(0 <= seed < 2**32 for seed in seeds)
    assert derive_seed(1, b"ab", 2) == derive_seed(1, b"ab", 2)
