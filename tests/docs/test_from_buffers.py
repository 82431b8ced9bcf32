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
    before = pd.read_csv(FOLDER / "scarce_seeds.csv").query("choice in ('uniform', 'oracle')")
    runs = pd.concat([before, pd.read_csv(FOLDER / "scarce_cubed.csv")]).query("patches == 256")
    return runs.set_index(["scene", "choice", "seed"]).sort_index()


def of_choice(runs: pd.DataFrame, scene: str, choice: str, error: str) -> pd.Series:
    found: pd.Series = runs.loc[(scene, choice), error]
    return found


def change(runs: pd.DataFrame, scene: str, choice: str, error: str) -> str:
    """As a cell has it, over all seeds of the choice; nothing where there is none."""
    if (scene, choice) not in runs.index.droplevel("seed"):
        return ""
    own = of_choice(runs, scene, choice, error)
    base = of_choice(runs, scene, "uniform", error)[own.index]
    return as_shown(difference_of(base, own)).replace(" %", "")


ORACLES = ("oracle_cubed", "oracle_relative")
TABLES = (
    (("hard_error", ("oracle", *ORACLES, "predicted_absolute", "predicted")),),
    tuple((error, (*ORACLES, "predicted")) for error in ("hard_tail", "uniform_error")),
    tuple((error, (*ORACLES, "predicted")) for error in ("hard_mape", "hard_mae")),
)
"""Of the section on choices, one after the other: errors, and the choices that have columns."""


def tables_of(runs: pd.DataFrame) -> list[list[list[str]]]:
    """Of each table the rows, without the scene."""
    return [
        [
            [change(runs, scene, choice, error) for error, choices in table for choice in choices]
            for scene in sorted(runs.xs("predicted", level="choice").index.unique("scene"))
        ]
        for table in TABLES
    ]


def test_what_choices_take_off_is_what_the_studys_runs_say() -> None:
    shown = rows_of(PAGE, "What a choice of patches takes off")
    for rows in tables_of(of_the_study()):
        assert shown[2 : 2 + len(rows)] == rows
        shown = shown[2 + len(rows) :]
    assert not shown


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
