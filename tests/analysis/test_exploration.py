from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from analysis.exploration import (
    COLUMNS,
    exploration_numbers,
    exploration_table,
)
from analysis.exploration_plots import PANELS, write_exploration_figures
from analysis.methods import name_methods
from analysis.plots import FORMATS, method_styles
from analysis.runs import Run, find_runs
from analysis.step_log import mean_over_time
from analysis.target_map import histogram_distances
from tests.analysis.conftest import MakeRun
from tests.analysis.traces import CHAINS, write_maps, write_steps, write_trace

COUNT = 120


@pytest.fixture
def runs(make_run: MakeRun, tmp_path: Path) -> list[Run]:
    """Two methods with a trace, two seeds each; one further run, of another scene, without."""
    generator = np.random.default_rng(0)
    for sampler, rate in (("uniform", 1.0), ("mcmc_loss_step", 0.2)):
        for seed in range(2):
            folder = make_run(sampler=sampler, seed=seed)
            accepted = generator.random((COUNT, CHAINS)) < rate
            accepted[0] = True
            write_trace(folder, generator.random((COUNT, CHAINS, 4)), accepted)
            write_maps(folder, 1 + np.arange(64.0).reshape(8, 8), [40, 80, COUNT])
            write_steps(folder, COUNT + 1)
    make_run(scene="sphere-caustic")
    return name_methods(find_runs(tmp_path / "runs")[0])


def test_numbers_of_a_run(runs: list[Run]) -> None:
    by_method = {run.method: exploration_numbers(run) for run in runs if run.scene == "mirror"}
    uniform, chains = by_method["uniform"], by_method["mcmc_loss_step"]
    assert uniform is not None
    assert chains is not None
    assert uniform["acceptance"] == uniform["median_lifetime"] == 1
    assert chains["acceptance"] == pytest.approx(0.2, abs=0.03)
    # Left with probability 0.2 at each proposal: half are left after log 0.5 / log 0.8 = 3.1.
    assert 3 <= chains["median_lifetime"] <= 4
    # Independent states, each held for a geometric time: autocorrelation 0.8^lag, so 1 in 9.
    assert uniform["effective_positions"] == pytest.approx(1000, rel=0.15)
    assert chains["effective_positions"] == pytest.approx(1000 / 9, rel=0.4)
    assert np.isnan(chains["effective_targets"])
    assert np.isnan(chains["small_step_acceptance"])
    assert chains["store_size"] == pytest.approx(16 * (109 + 120) / 2)


def test_the_table_has_a_row_per_scene_and_method_with_a_trace(runs: list[Run]) -> None:
    table = exploration_table(runs)
    texts = [[cell.text for cell in row] for row in table.rows]
    assert [row[:3] for row in texts] == [
        ["mirror", "uniform sampling", "2"],
        ["mirror", "mcmc_loss_step", "2"],
    ]
    assert {len(row) for row in texts} == {len(table.columns)}
    assert texts[0][table.columns.index("accepted")].startswith("1.00")
    assert texts[1][table.columns.index("small steps")] == "–"


def test_what_one_run_does_not_tell_is_not_the_others_mean(runs: list[Run]) -> None:
    """A median lifetime that was not reached is a long one, and not to be left out."""
    folder = next(run.folder for run in runs if run.method == "mcmc_loss_step")
    accepted = np.zeros((COUNT, CHAINS), bool)
    accepted[0] = True
    (folder / "chains.bin").unlink()
    write_trace(folder, np.random.default_rng(1).random((COUNT, CHAINS, 4)), accepted)
    numbers = [exploration_numbers(run) for run in runs if run.method == "mcmc_loss_step"]
    lifetimes = [found["median_lifetime"] for found in numbers if found is not None]
    assert np.isnan(lifetimes).tolist() == [True, False]
    table = exploration_table(runs)
    row = [cell.text for cell in table.rows[1]]
    assert row[:3] == ["mirror", "mcmc_loss_step", "2"]
    assert row[table.columns.index(COLUMNS["median_lifetime"])] == "–"


def test_figures_of_scenes_with_a_trace_are_written(runs: list[Run], tmp_path: Path) -> None:
    written = write_exploration_figures(runs, method_styles(runs), tmp_path)
    names = (
        "exploration_mirror",
        "histogram_scene_mirror",
        "histogram_patch_mirror",
        "distance_mirror",
    )
    assert [path.name for path in written] == [f"{n}.{s}" for n in names for s in FORMATS]
    for path in written:
        if path.suffix == ".png":
            with Image.open(path) as image:
                assert image.width > 900
                assert np.asarray(image.convert("L")).std() > 10  # something is on it
    assert "uniform sampling" in (tmp_path / "histogram_scene_mirror.svg").read_text()


@pytest.mark.filterwarnings("error")
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("steps", [[], [40, 80]])
def test_maps_that_are_no_density_leave_the_figures_of_the_others(
    runs: list[Run], tmp_path: Path, steps: list[int]
) -> None:
    for run in runs[: 4 if not steps else 1]:
        (run.folder / "target_map.bin").unlink(missing_ok=True)
        if steps:
            write_maps(run.folder, 1 + np.arange(64.0).reshape(8, 8), steps)
        write_maps(run.folder, np.zeros((8, 8)), [COUNT])
    assert len(write_exploration_figures(runs, method_styles(runs), tmp_path)) == 4 * len(FORMATS)


def test_runs_without_a_trace_leave_nothing_to_show(runs: list[Run], tmp_path: Path) -> None:
    without = [run for run in runs if run.scene == "sphere-caustic"]
    assert write_exploration_figures(without, method_styles(without), tmp_path) == []
    assert exploration_table(without).rows == ()
    assert histogram_distances(without).empty


def test_columns_are_averaged_over_equal_times() -> None:
    short = pd.DataFrame({"run_seconds": [1.0, 2, 3, 4], "x": [1.0, 3, np.nan, np.nan]})
    long = pd.DataFrame({"run_seconds": [1.0, 3, 4, 5, 6], "x": [0.0, 2, 4, 100, 100]})
    seconds, values = mean_over_time([short, long], "x", points=2)
    np.testing.assert_array_equal(seconds, [1, 3])
    np.testing.assert_array_equal(values, [[2, np.nan], [0, 3]])


def test_the_age_of_stored_patches_is_named_as_it_is_counted() -> None:
    """`PatchStore.mean_age` counts patches that were added since, not steps."""
    assert PANELS["store_mean_age"] == "mean age of stored patches, in patches"
    assert COLUMNS["store_mean_age"] == "their mean age in patches"
