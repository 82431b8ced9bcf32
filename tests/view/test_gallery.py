"""The light on a contact sheet, and mistakes in the commands of the sheet and of the page."""

import numpy as np
import pytest

from ngi.evaluate.pictures import srgb_picture
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer
from ngi.view.__main__ import main as view
from ngi.view.contact_sheet import CAPTION, COLUMNS, GAP, contact_sheet
from ngi.view.gallery import main

SIZE = 32


def test_direct_light_is_shown_as_the_radiance_that_it_is() -> None:
    layout = BufferLayout().adding(["direct"])
    renderer = AnalyticRenderer(dimensions=2, patch_size=16, layout=layout)
    sheet = contact_sheet(renderer, configurations=1, resolution=SIZE, samples_per_pixel=1)
    hard = renderer.hard_frames()
    tile = 1 + len(hard) + len(layout.names) + layout.names.index("direct")
    row, column = divmod(tile, COLUMNS)
    top, left = row * (SIZE + CAPTION + GAP) + CAPTION, column * (SIZE + GAP)
    light = renderer.image_buffers(hard[0], resolution=SIZE)[..., layout.slice("direct")].expm1()
    np.testing.assert_array_equal(
        np.asarray(sheet)[top : top + SIZE, left : left + SIZE], srgb_picture(light, 0.0)
    )


@pytest.mark.parametrize(
    ("words", "named"),
    [(["mirror", "configurations=0"], "configurations: 0"), (["nowhere"], "no scene ['nowhere']")],
)
def test_mistakes_are_named_before_anything_is_rendered(tmp_path, capsys, words, named) -> None:
    assert main([*words, f"folder={tmp_path / 'sheets'}"]) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / "sheets").exists()


def test_a_page_without_pixels_is_refused(tmp_path, capsys) -> None:
    assert view([f"run={tmp_path}", "resolution=0"]) == 2
    assert "resolution: 0: give at least 1" in capsys.readouterr().err
