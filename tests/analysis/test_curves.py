import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.curves import error_curve
from analysis.methods import name_methods
from analysis.plots import error_figure, method_styles, scene_panels
from analysis.runs import Run, find_runs


def run(*values: float) -> Run:
    seconds = [10.0 * (index + 1) for index in range(len(values))]
    return Run(None, {}, pd.DataFrame({"run_seconds": seconds, "hard_mape": values}))  # type: ignore[arg-type]


def test_band_is_the_interval_of_the_mean() -> None:
    curve = error_curve([run(1.00), run(1.02), run(0.98)], "hard_mape")
    assert curve is not None
    # With so little spread the interval of the logarithm is that of the value.
    low, high = stats.t.interval(0.95, 2, loc=1.0, scale=stats.sem([1.0, 1.02, 0.98]))
    assert curve.mean.tolist() == [pytest.approx(1.0)]
    assert (curve.low[0], curve.high[0]) == (
        pytest.approx(low, rel=2e-3),
        pytest.approx(high, rel=2e-3),
    )


def test_band_stays_above_zero() -> None:
    curve = error_curve([run(1.0), run(0.01), run(0.01)], "hard_mape")
    assert curve is not None
    assert 0 < curve.low[0] < curve.mean[0] < curve.high[0]
    assert math.log(curve.mean[0] / curve.low[0]) == pytest.approx(
        math.log(curve.high[0] / curve.mean[0])
    )


def test_one_seed_and_a_mean_of_zero_have_no_band() -> None:
    for runs in ([run(0.3, 0.2)], [run(0.0), run(0.0)]):
        curve = error_curve(runs, "hard_mape")
        assert curve is not None
        assert np.array_equal(curve.low, curve.mean)
        assert np.array_equal(curve.high, curve.mean)


@pytest.mark.parametrize("bad", [(0.4, math.nan, math.nan), (math.nan,) * 3, (0.4, 0.3, math.inf)])
def test_a_seed_that_diverged_is_left_out_and_counted(bad) -> None:
    curve = error_curve([run(0.8, 0.4, 0.2), run(*bad), run(0.6, 0.2, 0.1)], "hard_mape")
    assert curve is not None
    assert curve.seconds.tolist() == [10.0, 20.0, 30.0]
    assert curve.mean.tolist() == pytest.approx([0.7, 0.3, 0.15])
    assert (curve.n, curve.diverged) == (2, 1)


def test_the_legend_says_how_many_seeds_diverged(make_run, tmp_path) -> None:
    for seed in range(3):
        file = make_run(seed=seed) / "metrics.csv"
    table = pd.read_csv(file)
    table.loc[len(table) - 1, [name for name in table if name.startswith("hard")]] = math.nan
    table.to_csv(file, index=False)
    runs = name_methods(find_runs(tmp_path / "runs")[0])
    rows = [scene_panels(runs, set_name) for set_name in ("hard", "uniform")]
    hard, uniform = (
        axes.get_legend_handles_labels()[1][0]
        for axes in error_figure(rows, method_styles(runs)).axes[:: len(rows[0])]
    )
    assert hard.endswith("(2 seeds, 1 diverged)")
    assert uniform.endswith("(3 seeds)")


def test_band_of_differences_is_the_interval_of_the_mean_on_both_sides_of_zero() -> None:
    values = [-0.02, 0.05, -0.01]
    curve = error_curve([run(value) for value in values], "hard_mape", signed=True)
    assert curve is not None
    low, high = stats.t.interval(0.95, 2, loc=np.mean(values), scale=stats.sem(values))
    assert (curve.low[0], curve.high[0]) == (pytest.approx(low), pytest.approx(high))


def test_relmse_at_or_below_0_is_drawn(make_run, tmp_path) -> None:
    """The best method's is, by chance; a logarithmic axis would leave it out."""
    for method, end in (("uniform", 0.01), ("active_exploration", -1e-9)):
        folder = make_run(method=method)
        table = pd.read_csv(folder / "metrics.csv")
        values = np.geomspace(1, 0.01, len(table) - 1).tolist()
        table.assign(hard_relmse=[*values, end], uniform_relmse=1.0).to_csv(
            folder / "metrics.csv", index=False
        )
    runs = name_methods(find_runs(tmp_path / "runs")[0])
    panels = [p for p in scene_panels(runs, "hard") if p.metric in ("mape", "relmse")]
    figure = error_figure([panels], method_styles(runs))
    errors, signed = figure.axes
    assert errors.get_yscale() == "log"
    assert signed.get_yscale() == "symlog"
    assert signed.get_ylim()[0] < 0
    assert signed.transData.transform((0, 0.01))[1] < signed.transData.transform((0, 1))[1] - 20
