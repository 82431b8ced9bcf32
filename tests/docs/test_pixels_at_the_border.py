"""What the page of the learner says of centred patches is what was measured and counted."""

import re

import numpy as np
import pandas as pd
import pytest

from ngi.files.resources import root
from tests.docs.pages import ROOT
from tests.docs.tables import over_scenes, rows_of, tenths
from tests.docs.test_figures import geometric_mean, said

PAGE, SECTION = "docs/learner/README.md", "Pixels at the border"
RINGS = ["ring_0_5", "ring_5_16", "ring_16_32", "ring_32_48"]
COLUMNS = ["hard", "hard_mape", "uniform", "uniform_mape", *RINGS]


@pytest.fixture
def section() -> str:
    return (ROOT / PAGE).read_text().split(f"### {SECTION}")[1].split("\n##")[0]


def test_the_table_is_of_every_run() -> None:
    runs = pd.read_csv(root() / "docs/learner/centred.csv")
    for frames in ("hard", "uniform"):
        runs[frames] = geometric_mean(runs, frames)
    of = runs.set_index(["centred", "scene", "run"]).sort_index()[COLUMNS]
    corners, centres = of.loc[False], of.loc[True]
    rows = iter(rows_of(PAGE, SECTION)[2:])
    for _, changes in (centres / corners - 1).groupby("scene"):
        assert next(rows) == [str(len(changes)), *map(tenths, changes.mean())]
    means = [over_scenes(corners[column], centres[column]) for column in COLUMNS]
    shown = [f"{tenths(each.mean)} ± {100 * each.half_width:.1f}" for each in means]
    assert next(rows) == ["", *shown]
    less = [text.lstrip("−").replace(" ±", " % ±") for text in shown]
    number = r"(\d+\.\d % ± \d+\.\d)"
    uniform = rf"{number} less error on uniform frames"
    assert said(PAGE, rf"{uniform}, {number} less MAPE, and as much") == tuple(less[2:4])
    assert said("CHANGELOG.md", rf"{uniform} of seven scenes, as much on hard") == (less[2],)


def covered(resolution: int, patch_size: int, *, centred: bool) -> np.ndarray:
    """[R, R]: in how many patches each pixel is, the mean being 1."""
    places = resolution - patch_size
    corners = np.arange(places + 1)
    if centred:
        corners = np.clip(np.arange(resolution + 1) - patch_size // 2, 0, places)
    inside = np.arange(resolution)[:, None]
    times = ((corners <= inside) & (inside < corners + patch_size)).sum(axis=1)
    return np.outer(times, times) / times.mean() ** 2


def test_in_how_many_patches_pixels_are(section) -> None:
    large, small = (covered(96, size, centred=False) for size in (32, 16))
    centred, wide = covered(96, 32, centred=True), covered(256, 32, centred=False)
    assert f"in 1/{1 / large[0, 0]:.0f} as many patches as the mean pixel" in section
    assert f"in the middle in {large[48, 48]:.1f} times as many" in section
    shares = [f"{100 * (each < 0.25).mean():.0f} %" for each in (large, small, wide)]
    assert f"{shares[0]} of all pixels are in less than a quarter" in section
    middle = f"1/{1 / small[0, 0]:.0f}, {small[48, 48]:.1f} times, {shares[1]}"
    assert f"(16×16: {middle}; 32×32 in 256×256: {shares[2]})" in section
    least = re.search(r"no pixel is in less than ([\d.]+) as many", section)
    assert least is not None
    assert least[1] == f"{centred.min():.2f}"
    assert round(centred[48, 48], 1) == 1
