"""Labels of the comparison sheets, against the width that the font gives them."""

from itertools import pairwise

import pytest

from analysis.pictures import _font, _lines

LABEL = "path tracing + Open Image Denoise, 8 samples per pixel (seed 0)"


@pytest.mark.parametrize("width", [96, 192, 256, 2000])
def test_a_label_is_whole_in_lines_that_fit(width: int) -> None:
    lines = _lines(LABEL, width)
    assert " ".join(lines) == LABEL
    assert all(_font(14).getlength(line) <= width for line in lines)
    for line, following in pairwise(lines):  # no line ends too early
        assert _font(14).getlength(f"{line} {following.split()[0]}") > width


def test_a_word_that_is_too_long_has_a_line_of_its_own() -> None:
    assert _lines("a wordthatistoolong b", 20) == ["a", "wordthatistoolong", "b"]
