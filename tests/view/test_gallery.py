"""Mistakes in the commands of the contact sheet and of the page; what they show is for eyes."""

import pytest

from ngi.view.__main__ import main as view
from ngi.view.gallery import main


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
