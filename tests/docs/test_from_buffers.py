"""The tables of docs/exploration-ceiling/from-buffers.md are those of its runs."""

import numpy as np
import pandas as pd
import pytest

from tests.docs.pages import ROOT
from tests.docs.tables import as_shown, difference_of, rows_of, tenths
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
PREDICTED = ("predicted_absolute", "predicted")
TABLES = (
    (("hard_error", ("oracle", *ORACLES, *PREDICTED)),),
    tuple((error, (*ORACLES, "predicted")) for error in ("hard_tail", "uniform_error")),
    tuple((f"hard_{metric}", (*ORACLES, *PREDICTED)) for metric in ("mape", "mae")),
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


def test_what_uniform_patches_at_first_are_worth_is_what_the_studys_runs_say() -> None:
    runs = of_the_study()
    errors = ("hard_error", "hard_tail", "uniform_error", "uniform_tail")
    rows = [
        [change(runs, scene, choice, error) for error in errors]
        for scene in ("bathroom", "living-room")
        for choice in ("predicted", "predicted_after_96")
    ]
    assert rows_of(PAGE, "Uniformly at first")[2:] == rows


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


def of_runs(budget: str) -> pd.DataFrame:
    """The last evaluation of each, by method, scene and seed."""
    return last_of(pd.read_csv(FOLDER / "from_buffers.csv").query(f"budget == '{budget}'"))


def last_of(evaluations: pd.DataFrame) -> pd.DataFrame:
    """Of each run, by method, scene and seed."""
    by_run = evaluations.set_index(["method", "scene", "seed"]).sort_index()
    return by_run.groupby(level=[0, 1, 2]).last()


def errors_of(runs: pd.DataFrame) -> list[pd.Series]:
    """What the table of the runs has columns for."""
    by_frames = [(geometric_mean(runs, name), runs[f"{name}_tail"]) for name in FRAMES]
    return [error for errors in by_frames for error in errors]


FRAMES = ("hard", "uniform")
OTHERS = {
    "sobol": ("a Sobol sequence (`method=ours`), nothing looked at", "ours_uniform"),
    "uniform_again": ("uniform sampling, again on another machine", "ours_uniform"),
    "looked_at_random": ("random candidates, photons, many rays and forests", "ours_uniform"),
    "looked_quickly": ("random candidates, few rays and forests", "ours_uniform"),
    "looked_without_photons": ("random candidates, many rays and forests", "ours_uniform"),
    "absolute_drawn": ("by absolute errors, batches by chance", "uniform_drawn"),
    "relative_drawn": ("by relative errors, batches by chance", "uniform_drawn"),
    "looked_at_once": ("at once", "ours_uniform"),
}
"""Other runs that looked: as their table calls them, and what they are compared with."""


def changes_of(runs: pd.DataFrame, method: str, compared: str) -> list[pd.Series]:
    """What the tables have columns for, by scene and seed."""
    own = runs.loc[method]
    base = runs.loc[compared].loc[own.index]
    return [b / a - 1 for a, b in zip(errors_of(base), errors_of(own), strict=True)]


def mean_of(changes: pd.Series) -> str:
    """With its interval, and of how many."""
    return as_shown(difference_of(0 * changes + 1, 1 + changes)).replace(" %", "")


def less(cells: list[str]) -> list[str]:
    """Mean and interval of each of them, as prose has them: so much less."""
    return [number for cell in cells for number in cell.lstrip("−").split(" (")[0].split(" ± ")]


def over_scenes(columns: list[pd.Series]) -> list[str]:
    """The mean over scenes of each, of its pairs."""
    return [mean_of(changes.groupby("scene").mean()) for changes in columns]


def rows_of_runs(runs: pd.DataFrame) -> list[list[str]]:
    """One for each scene, then one over the scenes."""
    columns = changes_of(runs, LOOKING, "ours_uniform")
    own = runs.loc[LOOKING]
    base = runs.loc["ours_uniform"].loc[own.index]
    rows = []
    for scene in own.index.unique("scene"):
        here, uniform = own.loc[scene], base.loc[scene]
        assert (here.patches_traced == uniform.patches_traced).all()
        (steps,), (patches,) = here.step.unique(), here.patches_traced.unique()
        error = geometric_mean(uniform, "hard").mean()
        share = 100 * here.explore_seconds.sum() / here.run_seconds.sum()
        means = [mean_of(changes.loc[scene]) for changes in columns]
        rows.append([f"{steps:,}", f"{patches}", f"{error:.4f}", *means, f"{share:.1f}"])
    return [*rows, ["", "", "", *over_scenes(columns), ""]]


def rows_of_other_runs(runs: pd.DataFrame) -> list[list[str]]:
    """One for each kind, over its pairs."""
    rows = []
    for method, (_, compared) in OTHERS.items():
        own = runs.loc[method]
        scenes = ", ".join(own.index.unique("scene"))
        shares = 100 * (own.explore_seconds / own.run_seconds).groupby("scene").mean()
        means = map(mean_of, changes_of(runs, method, compared))
        rows.append([scenes, *means, ", ".join(f"{share:.1f}" for share in shares)])
    return rows


def test_what_runs_end_with_is_what_their_tables_say() -> None:
    runs = of_runs("scarce")
    shown = [[cell.strip("*") for cell in row] for row in rows_of(PAGE, "In runs")]
    now, others = rows_of_runs(runs), rows_of_other_runs(runs)
    assert shown[2 : 2 + len(now)] == now
    assert shown[len(now) + 4 :] == others


def test_what_can_be_told_is_what_the_studys_runs_say() -> None:
    runs = of_the_study()
    scenes = sorted(runs.xs("predicted", level="choice").index.unique("scene"))

    def mean(choice: str, error: str) -> float:
        changes = [
            of_choice(runs, scene, choice, error) / of_choice(runs, scene, "uniform", error) - 1
            for scene in scenes
        ]
        return float(np.mean([change.mean() for change in changes]))

    number = r"(\d+\.\d) %"
    pattern = rf"knows every error takes {number} .+? {number} .+? tell takes {number} .+? {number}"
    expected = [
        mean(choice, error)
        for choice in ("oracle_relative", "predicted")
        for error in ("uniform_error", "uniform_tail")
    ]
    shown = [float(value) for value in said(PAGE, pattern)]
    assert shown == pytest.approx([round(-100 * value, 1) for value in expected])


def of_cheap_choices() -> pd.DataFrame:
    """Of 4,096 patches of 32 samples per pixel, by scene, choice and seed."""
    runs = pd.read_csv(FOLDER / "small_relative.csv")
    runs.loc[runs.patches == 4096, "choice"] = "all"
    return runs.set_index(["scene", "choice", "seed"]).sort_index()


def rows_of_cheap_choices() -> list[list[str]]:
    """One for each scene, then one over the scenes."""
    runs = of_cheap_choices()
    uniform = runs.xs("uniform", level="choice")
    columns = [
        (runs.xs(choice, level="choice")[error] / uniform[error] - 1).dropna()
        for choice, error in (
            *(("oracle_relative", f"{f}_{kind}") for f in FRAMES for kind in ("error", "tail")),
            ("all", "hard_error"),
        )
    ]
    rows = [
        [mean_of(c.loc[scene]) if scene in c.index.unique("scene") else "" for c in columns]
        for scene in uniform.index.unique("scene")
    ]
    return [*rows, over_scenes(columns)]


def test_what_a_choice_takes_off_where_paths_are_cheap_is_what_the_studys_runs_say() -> None:
    shown = [[cell.strip("*") for cell in row] for row in rows_of(PAGE, "Where paths are cheap")]
    rows = rows_of_cheap_choices()
    assert shown[2:] == rows
    number = r"(\d+\.\d) % ± (\d+\.\d)"
    takes = rf"takes {number} off hard frames and {number} off their worst pixels, {number} off "
    said_of_all = said(PAGE, rf"\*\*It {takes}uniform frames and {number} off theirs")
    assert [*said_of_all] == less(rows[-1][:4])
    hard = [float(row[0].split()[0].replace("−", "-")) for row in rows[:-1]]
    scenes = of_cheap_choices().index.unique("scene")
    much = [scene for scene, change in zip(scenes, hard, strict=True) if change <= -5]
    assert [*said(PAGE, r"On hard frames only (\S+) offers 5 % or more")] == much


@pytest.mark.parametrize("page", ["docs/guide/sampler.md", PAGE])
def test_what_is_said_of_all_runs_is_the_last_row_of_their_table(page: str) -> None:
    shown = said(
        page,
        r"(\d\.\d) % ± (\d\.\d)(?:\]\([^)]+\))? less error on hard frames, "
        r"(\d\.\d) % ± (\d\.\d) less on their worst pixels",
    )
    assert [*shown] == less(rows_of_runs(of_runs("scarce"))[-1][3:5])


def percent(changes: pd.Series) -> str:
    """As prose has the mean of changes."""
    mean, interval = mean_of(changes).split(" (")[0].split(" ± ")
    return f"{mean} % ± {interval}"


def test_what_spreading_and_looking_gain_is_what_the_runs_that_both_have_say() -> None:
    runs = of_runs("scarce")
    pairs = runs.loc["sobol"].index.intersection(runs.loc[LOOKING].index)
    sequence, looked, both = (
        [change.loc[pairs] for change in changes_of(runs, method, "ours_uniform")]
        for method in ("sobol", "looked_at_random", LOOKING)
    )
    for frames, shown in (
        (0, r"has (−[^,]+) on hard frames, where random candidates have (\S+ % ± \S+) and both"),
        (2, r"on uniform frames (\S+ % ± [\d.]+), (\S+ % ± \S+) and"),
    ):
        assert said(PAGE, shown) == (percent(sequence[frames]), percent(looked[frames]))
    added = [(1 + b) / (1 + s) - 1 for b, s in zip(both, sequence, strict=True)]
    shown = r"\((\d) pairs\)\. Against the sequence alone both together have (.+?), of which"
    count, listed = said(PAGE, shown)
    assert count == str(len(pairs))
    assert listed.replace(" and ", ", ").split(", ") == [percent(change) for change in added]


def test_what_uniform_frames_of_living_room_pay_is_what_its_runs_say() -> None:
    runs = of_runs("scarce")
    own, base = (runs.loc[way].loc["living-room"] for way in ("looked_at_random", "ours_uniform"))
    for metric in ("MAPE", "DSSIM", "MAE", "LPIPS"):
        key = f"uniform_{metric.lower()}"
        (shown,) = said(PAGE, rf"on uniform frames of living-room .*?\b{metric}(?: is)? ([^%]+) %")
        assert shown == ", ".join(map(tenths, own[key] / base[key] - 1)), metric


def test_looking_takes_the_share_of_the_time_that_is_said() -> None:
    runs = of_runs("scarce").loc[LOOKING]
    shares = 100 * (runs.explore_seconds / runs.run_seconds).groupby("scene").mean()
    shown = said(PAGE, r"looking takes (\d\.\d) % on living-room and (\d\.\d) % on sphere-caustic")
    assert list(shown) == [f"{shares[scene]:.1f}" for scene in ("living-room", "sphere-caustic")]
