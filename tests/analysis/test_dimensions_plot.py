"""The figures of error differences on scenes of more and more variables."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.dimensions_plot import dimensions_figure, write_dimensions_figures
from analysis.runs import find_runs


def test_each_learner_has_a_figure_of_its_own(make_method, tmp_path) -> None:
    make_method("active_exploration", scene="salon-5")
    make_method("ours_uniform", scene="salon-5")
    assert write_dimensions_figures(find_runs(tmp_path)[0], tmp_path) == []
    make_method("ours_exploring", scene="salon-5")
    files = write_dimensions_figures(find_runs(tmp_path)[0], tmp_path)
    assert [file.name for file in files] == [
        f"ours_dimensions.{suffix}" for suffix in ("png", "svg", "pdf")
    ]
    assert (
        "error of ours with uniform sampling minus error of ours exploring" in files[1].read_text()
    )
    make_method("uniform", scene="salon-5")
    files = write_dimensions_figures(find_runs(tmp_path)[0], tmp_path)
    assert {file.stem for file in files} == {"dimensions", "ours_dimensions"}


def test_curves_are_the_uniform_error_less_that_of_exploration(make_method, tmp_path) -> None:
    folders = {
        method: make_method(method, scene="salon-7", error=error)
        for method, error in {"ours_exploring": 0.05, "ours_uniform": 0.2}.items()
    }
    errors = {
        method: np.genfromtxt(folder / "metrics.csv", delimiter=",", names=True)["hard_mae"]
        for method, folder in folders.items()
    }
    figure = dimensions_figure(find_runs(tmp_path)[0], ["mae"], "ours_dimensions")
    curve = figure.axes[0].lines[0]
    assert curve.get_label() == "salon-7"
    np.testing.assert_allclose(
        curve.get_ydata(), errors["ours_uniform"] - errors["ours_exploring"], rtol=1e-6
    )


def test_a_pair_of_which_a_run_diverged_is_left_out_and_said_so(make_method, tmp_path) -> None:
    for seed in range(3):
        for method, error in {"ours_exploring": 0.05, "ours_uniform": 0.2}.items():
            file = make_method(method, scene="salon-7", seed=seed, error=error) / "metrics.csv"
    whole = find_runs(tmp_path)[0]
    history = pd.read_csv(file)
    history.loc[2:, [name for name in history if name.startswith("hard")]] = np.nan
    history.to_csv(file, index=False)
    runs = find_runs(tmp_path)[0]
    (expected, found) = (
        dimensions_figure(of, ["mae"], "ours_dimensions").axes[0].lines[0]
        for of in ([run for run in whole if run.seed < 2], runs)
    )
    assert found.get_label() == "salon-7 (1 diverged)"
    np.testing.assert_array_equal(found.get_xydata(), expected.get_xydata())


@pytest.mark.parametrize("longer", ["ours_exploring", "ours_uniform"])
def test_curves_reach_to_where_both_runs_end(make_method, tmp_path, longer) -> None:
    for method in ("ours_exploring", "ours_uniform"):
        file = make_method(method, scene="salon-7") / "metrics.csv"
        history = pd.read_csv(file)
        ends = history["run_seconds"].max()
        if method == longer:  # by the batch that it ends with
            history["run_seconds"] *= 1.02
            history.to_csv(file, index=False)
    figure = dimensions_figure(find_runs(tmp_path)[0], ["mae"], "ours_dimensions")
    assert figure.axes[0].lines[0].get_xdata()[-1] == pytest.approx(ends)
