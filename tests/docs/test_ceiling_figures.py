"""The tables of docs/exploration-ceiling are those of its runs."""

from itertools import product

import pandas as pd
import pytest

from analysis.ceiling import EVERYWHERE, NO_CHOICE, differences
from tests.docs.pages import ROOT
from tests.docs.tables import (
    as_shown,
    difference_of,
    estimate_of,
    in_words,
    over_scenes,
    percent,
    rows_of,
    tenths,
)
from tests.docs.test_figures import geometric_mean, said

MAP = "exploration_map.csv.gz"
"""Of every folder with runs of the map."""


def test_the_tables_of_the_rare_with_clean_patches_are_of_its_runs() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/rare_256.csv").set_index(["method", "seed"])
    shown = rows_of("docs/exploration-ceiling/rare.md", "With clean patches")
    for method, rows in (("ours_eager", shown[2:4]), ("ours_exploring", shown[4:6])):
        for frames, row in zip(("hard", "uniform"), rows, strict=True):
            error = geometric_mean(runs, frames)
            base = error["ours", 0].to_numpy()
            seeds = error[method].groupby("seed")
            changes = [100 * own.to_numpy() / base - 100 for _, own in seeds]
            assert row == [", ".join(map(percent, each)) for each in zip(*changes, strict=True)]
    last = runs.groupby(level=["method", "seed"]).last()
    for method, frames, row in (
        ("ours_eager", "hard", shown[8]),
        ("ours_eager", "uniform", shown[9]),
        ("ours_exploring", "uniform", shown[11]),
    ):
        names = [f"{frames}_{name}" for name in ("mape", "dssim", "mae", "lpips", "relmse")]
        change = last.loc[method, names] / last.loc[("ours", 0), names]
        change[names[-1]] **= 0.5
        assert row == [", ".join(map(percent, 100 * change[name] - 100)) for name in names]


def test_what_is_said_of_who_knows_where_the_rare_is_is_what_the_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/rare_known.csv").query("step == 3000")
    known = rows_of("docs/exploration-ceiling/rare.md", "What could be had")[2]
    for frames, cell in zip(("hard", "uniform"), known[1:], strict=True):
        error = runs.set_index(["share_known", "seed"])[f"{frames}_error"]
        change = 100 * error[0.5] / error[0.0] - 100
        errors = ", ".join(f"{own:.4f}" for own in error[0.5])
        assert cell == f"{errors}: {', '.join(map(percent, change))} %"


def test_what_the_scenes_together_say_is_what_is_said_of_them() -> None:
    found = pd.read_csv(ROOT / "docs/exploration-ceiling/differences.csv")
    found = found[found["scene"] == EVERYWHERE].set_index(["steps", "choice", "error"])
    page = "docs/exploration-ceiling/README.md"
    number = r"(\d+\.\d % ± \d+\.\d)"
    for pattern, *rows in (
        (
            rf"seven scenes the oracle takes {number} off hard frames and {number} off uniform",
            (1600, "oracle", "hard_error"),
            (1600, "oracle", "uniform_error"),
        ),
        (
            rf"four times as many patches at once take {number} and {number} off",
            (1600, NO_CHOICE, "hard_error"),
            (1600, NO_CHOICE, "uniform_error"),
        ),
        (rf"draws the oracle takes {number} off:", (1600, "oracle_weighted", "hard_error")),
        (
            rf"all patches take {number} off and the oracle {number}\.",
            (400, NO_CHOICE, "hard_error"),
            (400, "oracle", "hard_error"),
        ),
        (
            rf"have {number} less error after 1,600 steps, {number} after 400",
            (1600, "oracle", "hard_tail"),
            (400, "oracle", "hard_tail"),
        ),
    ):
        assert said(page, pattern) == tuple(in_words(estimate_of(found.loc[row])) for row in rows)
    for other, pattern in (
        ("docs/exploration-ceiling/from-buffers.md", rf"took \[{number} off hard frames\]"),
        ("docs/guide/sampler.md", rf"proportion to its true error \({number} on hard frames"),
    ):
        (shown,) = said(other, pattern)
        assert shown == in_words(estimate_of(found.loc[1600, "oracle", "hard_error"]))


def test_what_the_floors_hide_of_the_study_is_what_its_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/runs.csv").query("steps == 1600")
    floors = pd.read_csv(ROOT / "docs/learner/results.csv").query("method == 'reference noise'")
    of_scene = floors.set_index("scene")

    def taken_off(run: tuple[str, int], share: int, frames: str) -> str:
        """Of √(error² − share · floor²), the geometric mean of MAPE and MAE."""
        columns = [f"{frames}_{metric}" for metric in ("mape", "mae")]
        squares = [runs[c] ** 2 - share * runs["scene"].map(of_scene[c]) ** 2 for c in columns]
        error = runs.assign(error=(squares[0] * squares[1]) ** 0.25)
        error = error.set_index(["choice", "patches", "scene", "seed"]).sort_index()["error"]
        return in_words(over_scenes(error["uniform", 1024], error[run]))

    number = r"(\d\.\d % ± \d\.\d)"
    pattern = (
        rf"oracle takes {number} off these two on hard frames and {number} on uniform ones .+? "
        rf"instead of {number} and {number} with the noise; "
        rf"all patches take {number} and {number} off \({number} and {number}\)"
    )
    ways = product((("oracle", 1024), ("uniform", 4096)), (1, 0), ("hard", "uniform"))
    measured = tuple(taken_off(*way) for way in ways)
    assert said("docs/exploration-ceiling/README.md", pattern) == measured


def test_how_near_samplers_come_is_what_the_runs_say() -> None:
    folder = ROOT / "docs/exploration-ceiling"
    small, scarce, quarter, clean_hour, hour = rows_of(
        "docs/exploration-ceiling/README.md", "How near samplers come"
    )[2:]
    for row, name in ((small, "runs.csv"), (scarce, "scarce_ceiling.csv")):
        found = differences(pd.read_csv(folder / name).query("steps == 1600"))
        found = found[(found["scene"] == EVERYWHERE) & (found["error"] == "hard_error")]
        by_choice = found.set_index("choice")
        choices = (NO_CHOICE, "oracle")
        assert row[:2] == [as_shown(estimate_of(by_choice.loc[choice])) for choice in choices]

    run = ["method", "scene", "seed"]
    same_time = pd.read_csv(folder / "same_time.csv").set_index(run)
    scarce_runs = pd.read_csv(folder / "scarce_chains.csv").groupby(run).last()
    chains = pd.read_csv(folder / "without_noise.csv").query("budget == 'small'").set_index(run)
    predicted, dear = (geometric_mean(runs, "hard") for runs in (same_time, scarce_runs))
    for cell, error, base, other in (
        (small[2], predicted, "ours", "ours_predicted"),
        (small[3], chains["hard_error"], "ours_uniform", "ours_exploring"),
        (scarce[3], dear, "ours_uniform", "ours_exploring"),
    ):
        assert cell == as_shown(difference_of(error[base], error[other]))
    anew = said(
        "docs/exploration-ceiling/README.md",
        r"drawn anew, too, predicted losses have (.+?), .+? expensive (\d.+?)\.\)",
    )
    of_scenes = (
        over_scenes(predicted["ours"], predicted["ours_predicted"]),
        over_scenes(dear["ours_uniform"], dear["ours_exploring"]),
    )
    assert anew == (in_words(of_scenes[0], "+"), in_words(of_scenes[1]))

    for row, name, chosen, pool in (
        (quarter, "quarter_hour.csv", 1792, 4096),
        (clean_hour, "hour_ceiling.csv", 7336, 16384),
    ):
        runs = pd.read_csv(folder / name).set_index(["scene", "seed"])
        error = {run: of_it["hard_error"] for run, of_it in runs.groupby(["patches", "choice"])}
        for cell, run in zip(row, ((pool, "uniform"), (chosen, "oracle")), strict=False):
            assert cell == as_shown(difference_of(error[chosen, "uniform"], error[run]))

    runs = pd.read_csv(folder / "hour.csv").set_index(["method", "scene", "seed"])
    ends = geometric_mean(runs.groupby(level=[0, 1, 2]).last(), "hard")
    assert hour[3] == as_shown(difference_of(ends["ours_uniform"], ends["ours_exploring"]))


def test_what_chains_do_in_an_hour_is_what_the_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/hour.csv").set_index(
        ["method", "scene", "seed"]
    )
    rows = iter(rows_of("docs/exploration-ceiling/README.md", "An hour")[2:])
    kinds = (("hard", ""), ("hard", "_worst5"), ("uniform", ""))
    for scene, seed in product(("living-room", "veach-egg"), (0, 1)):
        for frames, worst in kinds:
            exploring, uniform = (
                geometric_mean(runs.loc[(f"ours_{way}", scene, seed)], frames, worst)
                for way in ("exploring", "uniform")
            )
            changes = [tenths(each) for each in exploring.to_numpy() / uniform.to_numpy() - 1]
            shown = ["0.0" if change[1:] == "0.0" else change for change in changes]
            assert next(rows) == [f"{change} %" for change in shown]
    tails = runs[["hard_tail", "uniform_tail"]].dropna().xs("veach-egg", level="scene")
    less, more = 1 - tails.loc["ours_exploring"].iloc[0] / tails.loc["ours_uniform"].iloc[0]
    said = f"has {100 * less:.1f} % less on hard frames and {-100 * more:.1f} % more on uniform"
    assert said in (ROOT / "docs/exploration-ceiling/README.md").read_text()


def test_what_the_references_noise_hides_is_what_the_runs_say() -> None:
    folder, run = ROOT / "docs/exploration-ceiling", ["method", "scene", "seed"]
    runs = pd.read_csv(folder / "without_noise.csv")
    by_budget = {budget: of_it.set_index(run) for budget, of_it in runs.groupby("budget")}
    hour, scarce = (pd.read_csv(folder / f"{name}.csv") for name in ("hour_h200", "scarce_chains"))
    tenth = hour.groupby(run).nth(9).set_index(run)
    scarce = scarce.groupby(run).last()
    for each in (tenth, scarce):
        each["hard_error"] = geometric_mean(each, "hard")
        each["uniform_error"] = geometric_mean(each, "uniform")
    compared = (
        (by_budget["small"], "ours_uniform", "ours_exploring"),
        (by_budget["small (sampler comparison)"], "ours", "ours_predicted"),
        (by_budget["hour (32 samples per pixel)"], "ours_uniform", "ours_exploring"),
        (by_budget["hour"], "ours_uniform", "ours_exploring"),
        (tenth, "ours_uniform", "ours_exploring"),
        (by_budget["scarce (reuse=steady)"], "ours_uniform", "ours_exploring"),
        (scarce, "ours_uniform", "ours_exploring"),
    )
    page, section = "docs/exploration-ceiling/README.md", "What the references' noise hides"
    for row, (errors, base, other) in zip(rows_of(page, section)[2:9], compared, strict=True):
        powers = {"hard_error": 1, "uniform_error": 1, "hard_relmse": 0.5, "uniform_relmse": 0.5}
        measured = [
            as_shown(difference_of(error[base], error[other]))
            for error in (errors[column] ** power for column, power in powers.items())
        ]
        pairs = measured[0].split("(")[1][:-1]
        assert row == [pairs, *(each.split(" (")[0] for each in measured)]


def test_ratios_of_times_on_the_map_are_those_that_were_written() -> None:
    folder = ROOT / "docs/exploration-ceiling"
    written = {
        name: (folder / name / "errors.md").read_text().splitlines()
        for name in ("known", "long", "eager")
    }
    page = (folder / "predicted-losses.md").read_text().splitlines()
    assert {*written["known"], *written["long"]} <= {*page}

    def times(name: str, setting: str, sampler: str) -> list[str]:
        """To the same tail and to the same mean error, with reuse."""
        rows = ([cell.strip() for cell in line.split("|")[1:-1]] for line in written[name][4:])
        (row,) = [row for row in rows if (row[0], row[2], row[3]) == (setting, "yes", sampler)]
        return row[-2:]

    shown = rows_of("docs/exploration-ceiling/predicted-losses.md", "Eager, with reuse")[2:8]
    settings = ("base", "dimensions 2, active 2", "noise 1", "dimensions 32", "volume 0.1")
    for row, setting in zip(shown, [*settings, "volume 0.001"], strict=True):
        assert row[2:4] == times("eager", setting, "predicted loss, eager")
        assert row[4] == ", ".join(times("long", setting, "predicted loss"))


def test_what_could_be_had_at_a_tenth_is_what_the_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/known/tenth.csv").set_index(
        ["share", "seed"]
    )
    page = (ROOT / "docs/exploration-ceiling/predicted-losses.md").read_text()
    lines = page.split("### What could be had at a tenth")[1].split("\n\n")[2].splitlines()
    for share, line in zip((0.0, 0.1, 0.3), lines[2:], strict=True):
        here, uniform = runs.loc[share], runs.loc[0.0]
        cells = [cell.strip() for cell in line.split("|")[2:-1]]
        assert cells[:2] == [f"{here['lit'].mean():.3f}", f"{here['error_tail'].mean():.3f}"]
        for cell, name in zip(cells[2:], ("error_tail", "error_uniform"), strict=True):
            difference = difference_of(uniform[name], here[name])
            assert difference.half_width is not None
            measured = f"{percent(100 * difference.mean)} % ± {100 * difference.half_width:.0f}"
            assert cell == (measured if share else "")


def test_what_weights_leave_of_reuse_by_loss_is_what_the_runs_say() -> None:
    def base(name: str, sampler: str) -> pd.DataFrame:
        runs = pd.read_csv(ROOT / f"docs/exploration-ceiling/{name}")
        setting = "volume == 0.01 and dimensions == 8 and noise == 0 and step == 4000 and reuse"
        runs = runs.query(setting)
        return runs[runs["sampler"] == sampler].set_index("seed")

    page = (ROOT / "docs/exploration-ceiling/predicted-losses.md").read_text()
    said = page.split("**Weighted back to uniform draws, little")[1].split("\n")[0]
    weighted, uniform = base("by_loss/weighted.csv", "uniform"), base(f"long/{MAP}", "uniform")
    for words, runs in (
        ("{} % ± {} lower in place of", weighted),
        ("in place of {} % ± {}, though", base(f"by_loss/{MAP}", "uniform")),
    ):
        difference = difference_of(uniform["error_tail"], runs["error_tail"])
        assert difference.half_width is not None
        assert (
            words.format(*(f"{100 * x:.0f}" for x in (-difference.mean, difference.half_width)))
            in said
        )
    assert f"({weighted['lit'].mean():.3f})" in said
    eager = base("by_loss/weighted.csv", "eager"), base(f"eager/{MAP}", "eager")
    for column, digits in (("error_tail", 3), ("error_uniform", 4)):
        high, low = (runs[column] for runs in eager)
        assert (high > low).all()
        assert f"{high.mean():.{digits}f} in place of {low.mean():.{digits}f}" in said


def test_what_is_said_of_how_chains_mix_is_what_their_traces_say() -> None:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/mixing.csv")
    page = (ROOT / "docs/exploration-ceiling/predicted-losses.md").read_text()
    said = page.split("their states are alike.**")[1].split("\n")[0]
    for words, column, factor in (
        ("they accept {} to {} % of their", "acceptance", 100),
        ("only {} to {} count as", "effective_positions", 1),
        ("({} to {} by their targets", "effective_targets", 1),
        ("they accept {} to {} % of these", "large_step_acceptance", 100),
    ):
        ends = (round(factor * runs[column].min()), round(factor * runs[column].max()))
        assert words.format(*ends) in said
    assert set(runs["median_lifetime"]) == {1, 2}


@pytest.mark.parametrize(
    ("file", "section", "scenes", "chosen", "pool"),
    [
        ("quarter_hour.csv", "A quarter of an hour", ("living-room", "veach-egg"), 1792, 4096),
        ("hour_ceiling.csv", "The end of an hour", ("living-room", "veach-egg"), 7336, 16384),
    ],
)
def test_what_could_be_gained_with_clean_patches_is_what_the_runs_say(
    file: str, section: str, scenes: tuple[str, ...], chosen: int, pool: int
) -> None:
    every = pd.read_csv(ROOT / "docs/exploration-ceiling" / file)
    every = every.set_index(["scene", "patches", "choice", "seed"]).sort_index()
    columns = {"error": (1, 4), "tail": (1, 4), "relmse": (0.5, 3)}  # root and decimals
    cases = list(product(scenes, columns.items()))
    shown = rows_of("docs/exploration-ceiling/README.md", section)[2 : 2 + len(cases)]
    for row, (scene, (column, (power, digits))) in zip(shown, cases, strict=True):
        runs = every.loc[scene]
        errors = runs[[f"{frames}_{column}" for frames in ("hard", "uniform")]] ** power
        base = errors.loc[chosen, "uniform"]
        numbers = [" / ".join(f"{error:.{digits}f}" for error in of_one) for of_one in base.values]
        assert row[1] == "; ".join(numbers)
        for cell, run in zip(row[2:], ((chosen, "oracle"), (pool, "uniform")), strict=True):
            changes = 100 * (errors.loc[run] / base).dropna() - 100
            numbers = [" / ".join(f"{each:+.1f}" for each in of_one) for of_one in changes.values]
            assert cell == "; ".join(numbers).replace("-", "−")
