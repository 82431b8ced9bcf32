"""The tables of docs/exploration-ceiling are those of its runs."""

from itertools import product

import pandas as pd
import pytest

from analysis.ceiling import EVERYWHERE, NO_CHOICE, differences
from analysis.statistics import Estimate, difference_over_scenes, paired_difference
from tests.docs.pages import ROOT
from tests.docs.test_figures import geometric_mean, said

MAP = "exploration_map.csv.gz"
"""Of every folder with runs of the map."""


def rows_of(page: str, section: str) -> list[list[str]]:
    """Cells of the tables in a section, bold or not, without the first of each row."""
    text = (ROOT / page).read_text().split(f"## {section}")[1].split("\n## ")[0]
    lines = [line.replace("*", "") for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.split("|")[2:-1]] for line in lines]


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


def of_dear_patches() -> pd.DataFrame:
    """All runs of the ceiling at the scenes' own samples per pixel."""
    folder, run = ROOT / "docs/exploration-ceiling", ["scene", "choice", "patches", "steps", "seed"]
    tables = [pd.read_csv(folder / name) for name in ("scarce_ceiling.csv", "scarce_seeds.csv")]
    return pd.concat(tables).set_index(run).sort_index()


def by_oracle_of_dear_patches(patches: int, steps: int) -> Estimate:
    """The mean over scenes of each one's mean over all of its seeds, hard frames."""
    error = of_dear_patches()["hard_error"].xs((patches, steps), level=("patches", "steps"))
    return over_scenes(error.xs("uniform", level="choice"), error.xs("oracle", level="choice"))


def test_what_an_oracle_takes_off_dear_patches_is_what_the_runs_say() -> None:
    runs = of_dear_patches()
    page = "docs/exploration-ceiling/scarce.md"
    rows = rows_of(page, "What an oracle takes off")[2:9]
    sizes = ((128, 800), (256, 1600), (512, 3200))
    for row, scene in zip(rows, sorted(runs.index.unique("scene")), strict=True):
        error = runs.loc[scene, "hard_error"]
        for cell, size in zip(row[1:4], sizes, strict=True):
            found = difference_of(error["uniform", *size], error["oracle", *size])
            text, _, seeds = as_shown(found).partition(" % ")
            if found.n < 3:
                text = text.split(" ± ")[0]
            assert cell == (f"{text} {seeds}" if found.n > 3 else text), (scene, size)
        everything, half = error["uniform", 1024, 1600], error["uniform", 256, 1600]
        assert row[4] == as_shown(difference_of(half, everything)).split(" ")[0]

    means, *of_three = rows_of(page, "What an oracle takes off")[9:13]
    for cell, size in zip(means[1:3], sizes[:2], strict=True):
        assert cell == as_shown(by_oracle_of_dear_patches(*size)).split(" %")[0]
    found = differences(pd.read_csv(ROOT / "docs/exploration-ceiling/scarce_ceiling.csv"))
    of_all = found[found["scene"] == EVERYWHERE].set_index(["error", "patches", "choice"])
    for row, error in zip(of_three, ("hard_error", "uniform_error", "hard_tail"), strict=True):
        columns = [(size[0], "oracle") for size in sizes]
        for cell, column in zip(row[1:], [*columns, (256, NO_CHOICE)], strict=True):
            assert cell == as_shown(estimate_of(of_all.loc[(error, *column)])).split(" %")[0]

    shown = rows_of(page, "What comes near to it on bathroom")[2:]
    oracle = by_oracle_of_dear_patches(256, 1600)
    measured = tuple(as_shown(oracle).lstrip("−").split(" %")[0].split(" ± "))
    for where, before, after in (
        ("README.md", "few and clean ", ": the mean"),
        ("docs/guide/sampler.md", r"proportion to their true error \[", r"\]"),
        ("docs/exploration-ceiling/README.md", "the oracle takes ", " off hard frames after 256"),
    ):
        assert said(where, rf"{before}(\d\.\d) % ± (\d\.\d){after}") == measured

    seeds = pd.read_csv(ROOT / "docs/exploration-ceiling/scarce_seeds.csv")
    new = seeds.query("scene == 'bathroom' and patches == 256").set_index(["choice", "seed"])
    ways = ("oracle", "disagreement", "forest", "predicted")
    for row, choice in zip(shown, ways, strict=True):
        for cell, error in zip(row, ("hard_error", "hard_tail", "uniform_error"), strict=False):
            found = difference_of(new.loc["uniform", error], new.loc[choice, error])
            assert cell == as_shown(found).split(" %")[0]
        ranks = new.loc[choice, "rank_correlation"]
        assert row[3] == ("1" if choice == "oracle" else f"{ranks.mean():.1f}")


LEARNER = "With the paper's learner"


def papers_runs() -> pd.DataFrame:
    runs = pd.read_csv(ROOT / "docs/exploration-ceiling/scarce_paper.csv")
    return runs.set_index(["method", "scene"]).sort_index()


def by_quarter(runs: pd.DataFrame, method: str, frames: str, worst: str = "") -> pd.DataFrame:
    """[4, scenes] relative changes to uniform sampling at every second of eight evaluations."""
    error = geometric_mean(runs, frames, worst)
    return pd.DataFrame(
        {
            scene: error[method, scene].values[1::2] / error["uniform", scene].values[1::2] - 1
            for scene in runs.loc[method].index.unique()
        }
    )


def pooled(changes: pd.DataFrame) -> list[str]:
    """At every quarter, over the scenes, as the tables have it."""
    means = (difference_of(0 * change + 1, change + 1) for _, change in changes.iterrows())
    return [as_shown(mean).split(" %")[0] for mean in means]


def test_the_papers_learner_where_patches_are_dear_is_said_to_be_what_its_runs_say() -> None:
    runs = papers_runs()
    ways = (("hard", ""), ("hard", "_worst5"), ("uniform", ""))
    hard, worst, uniform = (by_quarter(runs, "active_exploration", *way) for way in ways)
    scenes = list(hard)
    rows = rows_of("docs/exploration-ceiling/scarce.md", LEARNER)
    of_scenes, of_all = rows[2 : 2 + len(scenes)], rows[4 + len(scenes) : 7 + len(scenes)]
    for scene, row in zip(scenes, of_scenes, strict=True):
        ends = [runs.loc[(way, scene)].iloc[-1] for way in ("uniform", "active_exploration")]
        counts = [", ".join(f"{int(end[c]):,}" for end in ends) for c in ("step", "patches_traced")]
        errors = [geometric_mean(pd.DataFrame([ends[0]]), f).iloc[0] for f in ("hard", "uniform")]
        assert row[:3] == [*counts, " / ".join(f"{error:.4f}" for error in errors)]
        assert row[3] == ", ".join(map(tenths, hard[scene]))
        assert row[4:] == [tenths(way[scene].iloc[-1]) for way in (worst, uniform)]
    assert of_all == [pooled(way) for way in (hard, worst, uniform)]


def test_exploring_at_constant_resolution_is_what_its_runs_say() -> None:
    runs = papers_runs()
    ways = [by_quarter(runs, "constant_resolution", frames) for frames in ("hard", "uniform")]
    *of_scenes, of_all = rows_of("docs/exploration-ceiling/scarce.md", LEARNER)[-4:]
    for scene, row in zip(ways[0], of_scenes, strict=True):
        assert row[2:] == [", ".join(map(tenths, way[scene])) for way in ways]
    assert of_all[2:] == [", ".join(pooled(way)) for way in ways]


def difference_of(base: pd.Series, other: pd.Series) -> Estimate:
    """Of `other` to `base`, paired by their index."""
    difference = paired_difference(base.to_dict(), other.to_dict())
    assert difference is not None
    return difference


def over_scenes(base: pd.Series, other: pd.Series) -> Estimate:
    """The same, of which every scene is one value; indexed by scene and seed."""
    difference = difference_over_scenes(base.to_dict(), other.to_dict())
    assert difference is not None
    return difference


def estimate_of(row: pd.Series) -> Estimate:
    """Of a row of `differences`."""
    return Estimate(row["difference"], row["half_width"], row["n"])


def tenths(change: float) -> str:
    return f"{100 * change:+.1f}".replace("-", "−")


def as_shown(difference: Estimate) -> str:
    """As the tables have it: '+3.0 ± 1.1 % (21)', and without ± where there is one pair."""
    interval = "" if difference.half_width is None else f" ± {100 * difference.half_width:.1f}"
    mean = f"{100 * difference.mean:+.1f}".replace("-0.0", "0.0")
    text = f"{mean}{interval} % ({difference.n})"
    return text.replace("-", "−")


def in_words(difference: Estimate, sign: str = "") -> str:
    """'1.2 % ± 2.3', as sentences have it."""
    assert difference.half_width is not None
    return f"{100 * abs(difference.mean):{sign}.1f} % ± {100 * difference.half_width:.1f}"


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
        ("docs/guide/sampler.md", rf"worth choosing on those scenes \({number} on hard frames"),
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
        rf"took {number} and {number} off as they are; "
        rf"all patches {number} and {number} \({number} and {number}\)"
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
        r"drawn anew, too, predicted losses have (.+?), .+? dear (\d.+?)\.\)",
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
    said = page.split("**Weighted back to uniform draws little")[1].split("\n")[0]
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
        ("they accept {} to {} %, let", "large_step_acceptance", 100),
    ):
        ends = (round(factor * runs[column].min()), round(factor * runs[column].max()))
        assert words.format(*ends) in said
    assert set(runs["median_lifetime"]) == {1, 2}


def percent(number: float) -> str:
    """Without decimals, as pages have it."""
    rounded = round(number)
    return "0" if rounded == 0 else f"{rounded:+d}".replace("-", "−")


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
