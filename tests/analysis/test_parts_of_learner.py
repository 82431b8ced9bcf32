"""Tables and picture of what each part of ours is worth."""

import sys
from io import BytesIO

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from PIL import Image
from scipy import stats

from analysis import parts_plot
from analysis.parts_of_learner import effect, effect_on, errors_by_part, errors_of, parts_table
from analysis.parts_plot import draw
from analysis.runs import METRICS, find_runs


def ablation() -> pd.DataFrame:
    errors = (
        ("box", "ours", 0, 0.1),
        ("box", "ours", 1, 0.2),
        ("box", "active_exploration", 0, 0.4),
        ("box", "ours_without/big_steps", 0, 0.12),
        ("box", "ours_without/big_steps", 1, 0.28),
        ("box", "ours_without/small_steps", 0, 0.11),
        ("box", "paper_with/big_steps", 0, 0.3),
        ("box", "paper_with/more", 0, 0.5),
        ("hall", "ours", 0, 0.2),
        ("hall", "ours_without/small_steps", 0, 0.3),
        ("hall", "ours_uniform", 0, 0.18),
        ("alone", "ours", 0, 0.1),
        ("partial", "ours_without/small_steps", 0, 0.3),
    )
    rows = [
        {"scene": s, "method": m, "seed": seed, **{f"hard_{k}": e for k in METRICS}}
        for s, m, seed, e in errors
    ]
    rows[0] |= {"hard_mape": 0.2, "hard_dssim": 0.05}  # the same geometric mean
    return pd.DataFrame(rows)


def test_parts_are_compared_with_the_whole_that_they_belong_to() -> None:
    assert parts_table(ablation()).splitlines() == [
        "| taken out of ours | box | hall | all of them |",
        "| :-- | --: | --: | --: |",
        "| *nothing* | **0.1500** | **0.2000** |  |",
        "| big steps | 0.2000 (+30 ± 127 %) |  | +30 % |",
        "| small steps | 0.1100 (+10 %) | 0.3000 (+50 %) | +30 ± 254 % |",
        "| sobol sequence |  | 0.1800 (-10 %) | -10 % |",
        "",
        "| added to the paper's method | box | all of them |",
        "| :-- | --: | --: |",
        "| *nothing* | **0.4000** |  |",
        "| big steps | 0.3000 (-25 %) | -25 % |",
        "| more | 0.5000 (+25 %) | +25 % |",
    ]


def test_a_metric_that_a_run_lacks_counts_for_none() -> None:
    results = ablation()
    results["hard_lpips"] *= 10
    results.loc[results["method"] == "ours_without/small_steps", "hard_lpips"] = np.nan
    found = effect(errors_by_part(results, "ours"), "small_steps")
    of_three = errors_by_part(results.assign(hard_lpips=np.nan), "ours")
    assert found == effect(of_three, "small_steps")


def test_a_run_that_diverged_takes_no_metric_from_the_others() -> None:
    results = ablation()
    results.loc[3, [f"hard_{metric}" for metric in METRICS]] = [np.inf, np.nan, np.inf, np.nan]
    errors = errors_by_part(results, "ours")
    assert np.isinf(errors.loc["big_steps", ("box", 0)])
    errors.loc["big_steps", ("box", 0)] = 0.12
    expected = errors_by_part(ablation(), "ours")
    pd.testing.assert_frame_equal(errors, expected, check_like=True)


def diverged(row: int) -> pd.DataFrame:
    results = ablation()
    results.loc[row, [f"hard_{metric}" for metric in METRICS]] = np.nan
    return results


def test_a_run_that_diverged_is_not_a_missing_one() -> None:
    """The mean of the other seeds would look like the mean of all."""
    assert parts_table(diverged(3)).splitlines()[2:6] == [
        "| *nothing* | **0.1500** | **0.2000** |  |",
        "| small steps | 0.1100 (+10 %) | 0.3000 (+50 %) | +30 ± 254 % |",
        "| sobol sequence |  | 0.1800 (-10 %) | -10 % |",
        "| big steps | 1 of 2 diverged (–) |  | – |",
    ]


def test_a_whole_method_that_diverged_takes_no_seed_away() -> None:
    assert parts_table(diverged(0)).splitlines()[2:6] == [
        "| *nothing* | **1 of 2 diverged** | **0.2000** |  |",
        "| sobol sequence |  | 0.1800 (-10 %) | -10 % |",
        "| big steps | 0.2000 (–) |  | – |",
        "| small steps | 0.1100 (–) | 0.3000 (+50 %) | – |",
    ]


def test_effects_are_paired_by_scene_and_seed() -> None:
    errors = errors_by_part(ablation(), "ours")
    found = effect_on("box", errors, "big_steps")
    paired = stats.ttest_rel([0.12 / 0.1, 0.28 / 0.2], [1, 1]).confidence_interval()
    assert found.n == 2
    assert found.mean - (found.half_width or 0) == pytest.approx(paired.low)
    assert found.mean + (found.half_width or 0) == pytest.approx(paired.high)
    assert effect_on("hall", errors, "big_steps") is None
    assert effect(errors, "sobol_sequence").half_width is None
    assert effect(errors, "").mean == 0
    assert errors_by_part(ablation().iloc[[3, 5]], "ours").empty


@pytest.fixture
def folder(tmp_path, make_method):
    for scene in ("box", "hall"):
        make_method("ours", scene=scene, error=0.1)
        make_method("ours", scene=scene, seed=1, error=0.1)
        make_method("ours_without/big_steps", scene=scene, error=0.2)
        make_method("active_exploration", scene=scene, error=0.4)
        make_method("paper_with/big_steps", scene=scene, error=0.3)
    return tmp_path


def test_the_picture_has_a_panel_per_ablation_and_scene(folder, tmp_path, monkeypatch) -> None:
    runs, _ = find_runs(folder)
    assert len(runs) == 10
    output = tmp_path / "report" / "learner"
    monkeypatch.setattr(sys, "argv", ["parts_plot", str(folder), str(output)])
    assert parts_plot.main() == 0
    picture = output / "parts.png"
    assert picture.read_bytes() == draw(runs)
    written = pd.read_csv(output / "ablation.csv")
    assert parts_table(written) == parts_table(errors_of(runs))
    assert list(written[written["scene"] == "box"]["seed"]) == [0, 0, 1, 0, 0]
    pixels = np.asarray(Image.open(BytesIO(picture.read_bytes())).convert("RGB")).astype(int)
    coloured = (pixels.max(axis=2) - pixels.min(axis=2)) > 60
    height, width = coloured.shape
    for row in (slice(0, height // 2), slice(height // 2, height)):
        for column in (slice(0, int(0.35 * width)), slice(int(0.35 * width), int(0.7 * width))):
            assert coloured[row, column].any()


def test_curves_of_parts_are_of_the_metrics_that_all_runs_have(make_method, tmp_path) -> None:
    """Else a part that was run without LPIPS' weights would look better than it is."""
    methods = ("ours", "ours_without/big_steps")
    files = [make_method(method, scene="box") / "metrics.csv" for method in methods]
    table = pd.read_csv(files[0]).assign(hard_lpips=0.5)
    table.to_csv(files[0], index=False)
    table.assign(hard_lpips=np.nan).to_csv(files[1], index=False)
    runs = {run.label["method"]: [run] for run in find_runs(tmp_path)[0]}
    axes = Figure().subplots()
    parts_plot._panel(axes, {"": runs[methods[0]], "big_steps": runs[methods[1]]}, {})
    whole, part = axes.lines
    np.testing.assert_array_equal(whole.get_ydata(), part.get_ydata())


def test_a_run_that_diverged_takes_no_curve_away(make_method, tmp_path) -> None:
    for seed in range(2):
        file = make_method("ours", scene="box", seed=seed) / "metrics.csv"
    whole = find_runs(tmp_path)[0]
    table = pd.read_csv(file)
    for start in (4, 0):
        table.loc[start:, [name for name in table if name.startswith("hard")]] = np.nan
        table.to_csv(file, index=False)
        axes = Figure().subplots()
        parts_plot._panel(axes, {"": find_runs(tmp_path)[0]}, {})
        parts_plot._panel(axes, {"": whole[:1]}, {})
        found, expected = axes.lines
        np.testing.assert_array_equal(found.get_xydata(), expected.get_xydata())
    parts_plot._panel(Figure().subplots(), {"": find_runs(tmp_path)[0][1:]}, {})


def test_other_runs_are_left_out_and_two_of_one_kind_refused(folder, make_method) -> None:
    here = errors_of(find_runs(folder)[0])
    make_method("ours_exploring", scene="box")
    assert errors_of(find_runs(folder)[0]).equals(here)
    make_method("ours", scene="box", budget="small")
    with pytest.raises(ValueError, match="two runs of ours on box with seed 0"):
        errors_of(find_runs(folder)[0])


def test_runs_without_a_whole_method_are_refused(folder, tmp_path, monkeypatch, capsys) -> None:
    runs = [run for run in find_runs(folder)[0] if run.label["method"] != "active_exploration"]
    with pytest.raises(ValueError, match="no runs of active_exploration with its parts"):
        draw(runs)
    monkeypatch.setattr(sys, "argv", ["parts_plot", str(tmp_path / "none"), "a"])
    assert parts_plot.main() == 1
    monkeypatch.setattr(sys, "argv", ["parts_plot"])
    assert parts_plot.main() == 2
    assert "FOLDER OUTPUT" in capsys.readouterr().err
