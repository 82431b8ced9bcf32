"""Previews against a machine whose speed is known: rays and pixels that each take their time."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from ngi.render import AnalyticRenderer
from ngi.view.scene_view import Place, SceneView
from ngi.view.session import FEWEST_RAYS, MOVING, SMALLEST, Pace

RAYS = 16
WHOLE = Place((0.5,), 256)


def machine(
    *, ray: float, pixel: float, fixed: float = 0.0, whole: float = 1.0
) -> Callable[[Place], SceneView]:
    """Shows a place in so many seconds per ray of the buffers and pixel of the network.

    whole: by how much the network's time is longer of whole pictures, whose edges it looks at again
    """

    def show(place: Place) -> SceneView:
        pixels = place.resolution**2
        seconds = {
            "buffers": fixed + ray * pixels * (place.rays or RAYS),
            "network": pixel * pixels * (whole if place.rays is None else 1),
        }
        renderer = AnalyticRenderer(dimensions=2, patch_size=4)
        return SceneView(place, renderer, lambda buffers, _: buffers, seconds=seconds)

    return show


def settled(show: Callable[[Place], SceneView], whole: Place = WHOLE) -> tuple[Place, float]:
    """The preview that it comes to while something moves, and the seconds that it takes."""
    pace = Pace(RAYS)
    for _ in range(10):
        view = show(pace.preview(whole))
        pace.measured(view)
    return view.place, sum(view.seconds.values())


@pytest.mark.parametrize("whole", [1.0, 3.0])
@pytest.mark.parametrize("fixed", [0.0, 0.015])
@pytest.mark.parametrize("ray", [1e-8, 2e-8, 5e-8, 1e-7, 2e-7, 4e-7])
def test_the_finest_that_is_quick_enough(ray: float, fixed: float, whole: float) -> None:
    show = machine(ray=ray, pixel=2e-7, fixed=fixed, whole=whole)
    place, seconds = settled(show)
    assert seconds <= MOVING
    rays = place.rays or RAYS
    if rays < RAYS:
        finer = show(replace(place, rays=4 if rays == FEWEST_RAYS else 2 * rays))
        assert sum(finer.seconds.values()) > MOVING


def test_a_quick_machine_shows_the_whole_picture_at_once() -> None:
    assert settled(machine(ray=1e-9, pixel=1e-9))[0] == WHOLE


def test_a_whole_picture_that_turned_out_slow_is_no_preview_again() -> None:
    show, pace = machine(ray=1e-8, pixel=2e-7, whole=20.0), Pace(RAYS)
    pace.measured(show(WHOLE))
    for _ in range(5):
        preview = pace.preview(WHOLE)
        assert preview.rays is not None
        pace.measured(show(preview))


def test_rays_are_given_up_before_pixels() -> None:
    place, _ = settled(machine(ray=3.5e-7, pixel=2e-7))
    assert place == replace(WHOLE, rays=FEWEST_RAYS)


def test_a_machine_that_is_never_quick_enough_gets_the_coarsest() -> None:
    place, seconds = settled(machine(ray=1.0, pixel=1.0))
    assert (place.resolution, place.rays) == (SMALLEST, FEWEST_RAYS)
    assert seconds > MOVING


def test_the_first_preview_is_the_coarsest_since_nothing_is_known() -> None:
    assert Pace(RAYS).preview(WHOLE) == replace(WHOLE, resolution=64, rays=FEWEST_RAYS)


@pytest.mark.parametrize("resolution", [32, 64])
def test_small_pictures_keep_their_pixels(resolution: int) -> None:
    small = replace(WHOLE, resolution=resolution)
    assert Pace(RAYS).preview(small).resolution == resolution


def test_where_a_pixel_has_one_ray_only_pixels_are_given_up() -> None:
    pace = Pace(1)
    assert pace.preview(WHOLE) == replace(WHOLE, resolution=64)
    pace.measured(machine(ray=1e-9, pixel=1e-9)(replace(WHOLE, rays=1)))
    assert pace.preview(WHOLE) == WHOLE
