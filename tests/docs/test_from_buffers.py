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


def test_what_choices_take_off_is_what_the_studys_runs_say() -> None:
    runs = of_the_study()
    rows = rows_of(PAGE, "What a choice of patches takes off")[2:]
    scenes = sorted(runs.xs("predicted", level="choice").index.unique("scene"))
    assert len(rows) == len(scenes) + 1
    means: dict[str, list[float]] = {f"{c} {e}": [] for c in CHOICES for e in ("hard", "tail")}
    for scene, (seeds, *cells) in zip(scenes, rows, strict=False):
        pairs = of_choice(runs, scene, "predicted", "hard_error").index
        assert seeds == f"{len(pairs)}"
        expected = [change(runs, scene, choice, "hard_error", pairs) for choice in CHOICES]
        expected += [change(runs, scene, choice, "hard_tail", pairs) for choice in CHOICES]
        expected += [change(runs, scene, "predicted", "uniform_error", pairs)]
        assert cells == expected, scene
        for choice in CHOICES:
            for name, error in (("hard", "hard_error"), ("tail", "hard_tail")):
                ratio = of_choice(runs, scene, choice, error) / of_choice(
                    runs, scene, "uniform", error
                )
                means[f"{choice} {name}"].append(ratio[pairs].mean())
    for cell, choice in zip(rows[-1][1:4], CHOICES, strict=True):
        values = pd.Series(means[f"{choice} hard"])
        assert cell == as_shown(difference_of(0 * values + 1, values)).split(" %")[0]
    for cell, choice in zip(rows[-1][4:7], CHOICES, strict=True):
        values = pd.Series(means[f"{choice} tail"])
        assert cell == as_shown(difference_of(0 * values + 1, values)).split(" %")[0]


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


def test_looking_takes_the_share_of_the_time_that_is_said() -> None:
    looking = of_runs("scarce", "bathroom").loc[LOOKING]
    shares = 100 * looking["explore_seconds"] / looking["run_seconds"]
    shown = said(PAGE, r"takes (\d\.\d) to (\d\.\d) % of the run time")
    assert [float(share) for share in shown] == pytest.approx(
        np.round([shares.min(), shares.max()], 1)
    )
