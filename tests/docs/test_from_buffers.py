"""The tables of docs/exploration-ceiling/from-buffers.md are those of its runs."""

import numpy as np
import pandas as pd
import pytest

from tests.docs.pages import ROOT
from tests.docs.test_ceiling_figures import as_shown, difference_of, rows_of, tenths
from tests.docs.test_figures import geometric_mean, said

FOLDER = ROOT / "docs/exploration-ceiling"
PAGE = "docs/exploration-ceiling/from-buffers.md"
LOOKING = "ours_predicted_from_buffers"


def of_the_study() -> pd.DataFrame:
    """256 of 1,024 patches, by scene, choice and seed."""
    tables = [pd.read_csv(FOLDER / name) for name in ("scarce_seeds.csv", "scarce_cubed.csv")]
    runs = pd.concat(tables).query("patches == 256")
    runs = runs.drop_duplicates(["scene", "choice", "seed"], keep="last")
    return runs.set_index(["scene", "choice", "seed"]).sort_index()


def of_choice(runs: pd.DataFrame, scene: str, choice: str, error: str) -> pd.Series:
    found: pd.Series = runs.loc[(scene, choice), error]
    return found


def change(runs: pd.DataFrame, scene: str, choice: str, error: str, pairs: pd.Index) -> str:
    """As a cell has it, over these seeds."""
    base, own = (of_choice(runs, scene, name, error)[pairs] for name in ("uniform", choice))
    return as_shown(difference_of(base, own)).split(" %")[0]


CHOICES = ("oracle", "oracle_cubed", "predicted")


def row_of(runs: pd.DataFrame, scene: str) -> list[str]:
    """Over the seeds of the sampler's choice; nothing where the cubed oracle has no runs."""
    pairs = of_choice(runs, scene, "predicted", "hard_error").index
    there = runs.loc[scene].index.unique("choice")
    cells = [
        change(runs, scene, choice, error, pairs) if choice in there else ""
        for error in ("hard_error", "hard_tail")
        for choice in CHOICES
    ]
    return [f"{len(pairs)}", *cells, change(runs, scene, "predicted", "uniform_error", pairs)]


def test_what_choices_take_off_is_what_the_studys_runs_say() -> None:
    runs = of_the_study()
    scenes = sorted(runs.xs("predicted", level="choice").index.unique("scene"))
    shown = rows_of(PAGE, "What a choice of patches takes off")
    assert shown[2 : 2 + len(scenes)] == [row_of(runs, scene) for scene in scenes]
    metrics = shown[4 + len(scenes) :]
    for row, scene in zip(metrics, scenes, strict=True):
        found = (f"hard_{metric}" for metric in ("mape", "dssim", "mae", "lpips"))
        pairs = of_choice(runs, scene, "predicted", "hard_error").index
        assert row == [change(runs, scene, "predicted", error, pairs) for error in found]


def test_what_was_tried_is_what_its_runs_say() -> None:
    runs = pd.read_csv(FOLDER / "from_buffers_tried.csv").set_index(["choice", "seed"])
    rows = rows_of(PAGE, "Why this was not seen before")[2:]
    assert len(rows) == len(runs.index.unique("choice")) - 1
    uniform = runs.loc["uniform"]
    for choice, own in runs.groupby(level="choice"):
        if choice != "uniform":
            own = own.droplevel("choice")
            changes = [tenths(own.hard_error[i] / uniform.hard_error[i] - 1) for i in own.index]
            chosen = f"{own.error_of_chosen.mean():.2f}"
            assert [", ".join(changes), chosen] in rows, choice


def of_runs(budget: str, scene: str) -> pd.DataFrame:
    """The last evaluation of each."""
    runs = pd.read_csv(FOLDER / "from_buffers.csv").query(
        f"budget == '{budget}' and scene == '{scene}'"
    )
    return runs.set_index(["method", "seed"]).sort_index().groupby(level=[0, 1]).last()


def test_what_runs_end_with_is_what_their_table_says() -> None:
    runs = of_runs("scarce", "bathroom")
    looking, uniform = runs.loc[LOOKING], runs.loc["ours_uniform"]
    *rows, means = rows_of(PAGE, "In runs")[2:]
    assert len(rows) == len(looking) == len(uniform)
    errors = [
        (geometric_mean(run, "hard"), run["hard_tail"], geometric_mean(run, "uniform"))
        for run in (uniform, looking)
    ]
    for seed, row in zip(looking.index, rows, strict=True):
        counts = f"{uniform.patches_traced[seed]}, {looking.patches_traced[seed]}"
        changes = [tenths(b[seed] / a[seed] - 1) for a, b in zip(*errors, strict=True)]
        assert row == [counts, f"{errors[0][0][seed]:.4f}", *changes]
    assert means[2:] == [
        as_shown(difference_of(a, b)).split(" %")[0] for a, b in zip(*errors, strict=True)
    ]


def test_the_readme_says_what_the_page_says() -> None:
    runs, looked = of_the_study(), of_runs("scarce", "bathroom")
    hard = geometric_mean(looked, "hard")
    expected = [
        change(runs, scene, "predicted", error, of_choice(runs, scene, "predicted", error).index)
        for scene in ("bathroom", "living-room")
        for error in ("hard_error", "hard_tail")
    ]
    expected.append(
        as_shown(difference_of(hard.loc["ours_uniform"], hard.loc[LOOKING])).split(" %")[0]
    )
    number = r"(\d+\.\d) % ± (\d+\.\d)"
    pattern = rf"of bathroom have {number} less .+? and {number} less on their worst"
    pattern += rf".+?of living-room {number} and {number} less; .+? end with {number} less"
    shown = said("README.md", pattern)
    pairs = zip(shown[::2], shown[1::2], strict=True)
    assert [f"−{mean} ± {interval}" for mean, interval in pairs] == expected


def test_looking_takes_the_share_of_the_time_that_is_said() -> None:
    looking = of_runs("scarce", "bathroom").loc[LOOKING]
    shares = 100 * looking["explore_seconds"] / looking["run_seconds"]
    shown = said(PAGE, r"takes (\d\.\d) to (\d\.\d) % of the run time")
    assert [float(share) for share in shown] == pytest.approx(
        np.round([shares.min(), shares.max()], 1)
    )
