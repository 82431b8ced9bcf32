"""What the page shows a browser, which is a stand-in."""

from contextlib import closing
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from skimage.feature import match_template

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

from ngi.render import AnalyticRenderer  # noqa: E402
from ngi.view.page import Page  # noqa: E402
from ngi.view.scene_view import Place, SceneView  # noqa: E402
from ngi.view.screen import Screen  # noqa: E402
from ngi.view.session import Wish  # noqa: E402
from ngi.view.studio import Shown  # noqa: E402
from tests.view.browser import Browser, coloured, studio, subject, visitor  # noqa: E402

SIZE = 300


def test_a_browser_that_left_while_its_controls_were_made_is_drawn_nothing(
    browser: Browser,
) -> None:
    made = studio()
    page = Page(made, subject(), resolution=64, host="127.0.0.1", port=0)
    with closing(page):
        page._welcome(browser)  # type: ignore[arg-type]  # which is not among the server's
    assert not made.waiting


@pytest.mark.parametrize(("show", "parts"), [("network", 1), ("network | path tracer", 2)])
def test_pictures_side_by_side_have_their_names_above_them(
    browser: Browser, show: str, parts: int
) -> None:
    made = visitor(browser)
    view = SceneView(
        Place((0.5,) * 7, SIZE),
        AnalyticRenderer(dimensions=7, patch_size=16),
        coloured,
    )
    screen = Screen(show)
    browser.camera.aspect = parts + 0.0
    made.show(Shown(screen.pixels(view), view, Wish(view.place, screen), full=True))
    ((pixels, format),) = browser.shown
    assert format == "png"
    pictures = np.split(screen.pixels(view), parts, axis=1)
    if parts == 1:
        np.testing.assert_array_equal(pixels, pictures[0])
        return
    for half, picture in zip(np.split(pixels, parts, axis=1), pictures, strict=True):
        top = np.flatnonzero((half == picture[0, 0]).all(axis=-1).any(axis=1))[0]
        assert (half[:top] > 200).any(), "its name"
        assert match_template(half.mean(-1), picture.mean(-1)).max() > 0.999


def test_pictures_too_small_for_the_metrics_are_shown_without(browser: Browser) -> None:
    for side, said in ((8, "metrics take 11 pixels a side"), (16, "MAPE")):
        picture = torch.rand(side, side, 3, generator=torch.Generator().manual_seed(0))
        view: Any = SimpleNamespace(prediction=picture, reference=picture / 2)
        shown: Any = SimpleNamespace(view=view)
        assert visitor(browser)._metrics(shown).startswith(said)
