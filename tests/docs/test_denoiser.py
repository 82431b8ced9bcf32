"""What docs/learner says of the denoiser's guides, qualities and time is what was measured."""

import json

import numpy as np
import pandas as pd

from analysis.runs import METRICS
from tests.docs.pages import ROOT
from tests.docs.tables import rows_of
from tests.docs.test_figures import geometric_mean, learner_errors, range_of, said

PAGE = "docs/learner/README.md"
SECTION = "The denoiser at its best, and at its fastest"
QUALITIES = ("high", "balanced", "fast")


def denoised() -> pd.DataFrame:
    """Told that its guides have no noise, by guides, quality, samples per pixel and scene."""
    runs = pd.read_csv(ROOT / "docs/learner/denoiser.csv").query("clean_guides")
    runs["error"] = geometric_mean(runs, "hard")
    return runs.set_index(["guides", "quality", "samples_per_pixel", "scene"]).sort_index()


def of_frames(part: str) -> pd.Series:
    """Medians on the Xeon, by scene and pixels a side."""
    figures = json.loads((ROOT / "docs/learner/frames-xeon.json").read_text())["figures"]
    named = [(*each["name"].rsplit(", ", 1), each) for each in figures]
    found = {
        (each["scene"], int(size.split()[0])): each["median"]
        for name, size, each in named
        if name == part
    }
    return pd.Series(found)


def milliseconds(part: str) -> pd.Series:
    """Of frames of 96 x 96 pixels, by scene."""
    return of_frames(part).xs(96, level=1)


def test_what_guides_along_chains_gain_is_what_was_measured() -> None:
    errors = denoised()["error"]
    change = 100 * (errors["chain", "high", 8] / errors["first hit", "high", 8] - 1)
    assert (change.idxmin(), change.idxmax(), len(change)) == ("bathroom", "veach-door", 7)
    words = r"it has ([\d.]+) % less error on `bathroom` to ([\d.]+) % more on `veach-door`"
    assert said(PAGE, words) == (f"{-change.min():.1f}", f"{change.max():.1f}")


def test_the_table_of_qualities_is_what_was_measured() -> None:
    errors = denoised()["error"]["first hit"]
    times = pd.read_csv(ROOT / "docs/learner/denoiser_times.csv")
    times = times.pivot_table(values="milliseconds", index="quality", columns="pixels")
    expected = []
    for quality in QUALITIES:
        more = 100 * (errors[quality, 8] / errors["high", 8] - 1)
        said_of_error = "" if quality == "high" else f"{more.min():.1f} to {more.max():.1f} % more"
        expected.append([*(f"{each:,.0f}" for each in times.loc[quality]), said_of_error])
    assert rows_of(PAGE, SECTION)[2:] == expected
    more = 100 * (errors["fast", 8] / errors["high", 8] - 1)
    readme = r"with (\d+) to (\d+) % more error, it is (0\.\d+) to (0\.\d+) on that Xeon"
    assert said("README.md", readme) == (
        *(f"{each:.0f}" for each in (more.min(), more.max())),
        *range_of("ours / paths and fast denoiser", "frames-xeon"),
    )


def test_the_share_of_the_fast_denoiser_s_time_is_what_was_measured() -> None:
    names = ("ours / paths and fast denoiser", "ours / paths and denoiser")
    fast, best = map(of_frames, names)
    assert fast.idxmax() == best.idxmax() == ("sphere-caustic", 96)
    words = (
        r"takes (0\.\d+) to (0\.\d+) of the time\*\* on that Xeon, where it takes (0\.\d+) to "
        r"(0\.\d+) beside the best\. .*? without it (0\.\d+)\."
    )
    ranges = [each for name in names for each in range_of(name, "frames-xeon")]
    others = fast.drop(fast.idxmax()).max()
    assert said(PAGE, words) == (*ranges, f"{others:.2f}")


def test_after_as_much_time_ours_has_less_error_than_the_fast_denoiser() -> None:
    """With as many samples per pixel as fit, rounded up to what was measured."""
    left = milliseconds("ours") - milliseconds("fast denoiser")
    fitting = left / (milliseconds("paths, 8 samples per pixel") / 8)
    others = fitting.drop("sphere-caustic")
    words = r"has time for ([\d.]+) samples per pixel on `sphere-caustic` and ([\d.]+) to ([\d.]+)"
    expected = (fitting["sphere-caustic"], others.min(), others.max())
    assert said(PAGE, words) == tuple(f"{each:.1f}" for each in expected)
    bounds = [int(np.floor(each + 0.05)) for each in (others.min(), fitting.max())]
    assert said("README.md", r"samples per pixel, (\d) to (\d) at its fastest") == tuple(
        map(str, bounds)
    )
    runs, ours = denoised().loc["chain", "fast"], learner_errors().loc["ours"]
    samples = {scene: 8 if scene == "sphere-caustic" else 5 for scene in fitting.index}
    theirs = pd.DataFrame({scene: runs.loc[(samples[scene], scene)] for scene in samples}).T
    for scene, fits in fitting.items():
        assert fits < samples[scene] + 0.05
    metrics = [f"hard_{metric}" for metric in METRICS]
    assert (ours.loc[theirs.index] < theirs[metrics]).all(axis=None)
    both = theirs.error.astype(float) / geometric_mean(ours.loc[theirs.index], "hard")
    more = 100 * (both - 1)
    words = r"errors is (\d+) % \(`veach-door`\) to (\d+) % \(`bedroom`\) higher than that of ours"
    assert (more.idxmin(), more.idxmax()) == ("veach-door", "bedroom")
    assert said(PAGE, words) == (f"{more.min():.0f}", f"{more.max():.0f}")
