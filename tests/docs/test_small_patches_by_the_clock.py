"""What docs/exploration-ceiling/small-patches.md says of ten minutes is what their runs say."""

import pandas as pd
import pytest

from tests.docs.tables import as_shown, ends_of, in_words, over_scenes, rows_of, tenths
from tests.docs.test_figures import said
from tests.docs.test_from_buffers import FOLDER, errors_of

PAGE = "docs/exploration-ceiling/small-patches.md"
SECTION = "After the same ten minutes"


def ends() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Of uniform sampling and of small patches, by scene and seed."""
    uniform, small = ends_of(FOLDER / "scarce_same_time.csv")
    for runs in (uniform, small):
        assert runs.run_seconds.tolist() == pytest.approx([600] * len(runs), rel=0.04)
    return uniform, small


def test_the_table_says_what_the_runs_say() -> None:
    uniform, small = ends()
    rows = []
    for scene, before in uniform.groupby("scene"):
        now = small.loc[[scene]]
        counts = [
            f"{runs[column].iloc[0]:,}"
            for column in ("step", "patches_traced")
            for runs in (before, now)
        ]
        errors = zip(errors_of(before), errors_of(now), strict=True)
        rows.append([*counts, *(tenths(b.iloc[0] / a.iloc[0] - 1) for a, b in errors)])
    found = [over_scenes(a, b) for a, b in zip(*map(errors_of, (uniform, small)), strict=True)]
    mean = [as_shown(each).replace(" %", "") for each in found]
    assert rows_of(PAGE, SECTION)[2:] == [*rows, ["", "", "", "", *mean]]


def test_the_pages_say_the_means_of_the_table() -> None:
    uniform, small = ends()
    pairs = zip(*map(errors_of, (uniform, small)), strict=True)
    hard, *others = (in_words(over_scenes(before, now)) for before, now in pairs)
    number = r"(\d+\.\d % ± \d+\.\d)"
    words = rf"After the same ten minutes small patches have {number} less error"
    assert said(PAGE, words) == (hard,)
    words = rf"and {number} less on their worst pixels; on uniform frames {number} and {number}"
    assert said(PAGE, words) == tuple(others)
    for page in ("README.md", "docs/guide/sampler.md", "CHANGELOG.md"):
        assert said(page, rf"after the same ten minutes {number} less") == (hard,)


def test_what_looking_takes_is_what_the_runs_say() -> None:
    _, small = ends()
    shares = 100 * small.explore_seconds / small.run_seconds
    expected = f"{shares.min():.1f}", f"{shares.max():.1f}"
    assert said(PAGE, r"Looking took ([\d.]+) to ([\d.]+) % of the time") == expected


def test_what_runs_with_new_patches_to_the_end_had_is_what_they_say() -> None:
    now, before = ends(), ends_of(FOLDER / "scarce_new_to_the_end.csv")
    pairs = [list(zip(*map(errors_of, pair), strict=True)) for pair in (before, now)]
    number = r"(\d+\.\d % ± \d+\.\d)"
    words = rf"it was {number} on hard frames, {number} on their worst pixels, {number} on uniform"
    expected = [in_words(over_scenes(*pair)) for pair in pairs[0]]
    assert said(PAGE, rf"{words} frames and {number} on theirs") == tuple(expected)
    by_method = list(zip(before, now, strict=True))
    both = [
        pd.concat([errors_of(a)[0], errors_of(b)[0].rename(index={0: 1}, level="seed")])
        for a, b in by_method
    ]
    words = rf"the mean of both rounds is {number} on hard frames"
    assert said(PAGE, words) == (in_words(over_scenes(*both)),)
    less = [in_words(over_scenes(errors_of(a)[0], errors_of(b)[0])) for a, b in by_method]
    words = (
        rf"the present runs have {number} less error on hard frames with uniform sampling and "
        rf"{number} with small patches"
    )
    assert said(PAGE, words) == tuple(less)


def test_what_positions_of_corners_had_is_what_their_runs_say() -> None:
    uniform, small = ends_of(FOLDER / "scarce_new_to_the_end.csv")
    corners = ends_of(FOLDER / "scarce_corners.csv")
    hard, _, common, _ = zip(*map(errors_of, corners), strict=True)
    number = r"(\d+\.\d % ± \d+\.\d)"
    words = rf"it was {number} on hard frames and {number} on uniform ones"
    assert said(PAGE, words) == tuple(in_words(over_scenes(*pair)) for pair in (hard, common))
    less = [
        [in_words(over_scenes(a, b)) for a, b in zip(*map(errors_of, pair), strict=True)]
        for pair in zip(corners, (uniform, small), strict=True)
    ]
    words = (
        rf"with centres, have {number} less error on hard frames with uniform sampling and {number}"
    )
    assert said(PAGE, words) == (less[0][0], less[1][0])
    words = rf"than those had, {number} and {number} on uniform ones"
    assert said(PAGE, words) == (less[0][2], less[1][2])
    more = [
        100 * (now.patches_traced / before.patches_traced - 1)
        for before, now in zip(corners, (uniform, small), strict=True)
    ]
    least, most = (f"{limit(map(limit, more)):.0f}" for limit in (min, max))
    assert said(PAGE, r"which traced (\d+) to (\d+) % more patches") == (least, most)
