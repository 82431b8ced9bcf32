"""What docs/exploration-ceiling/scarce.md says is what its runs say."""

import pandas as pd

from analysis.ceiling import EVERYWHERE, NO_CHOICE, differences
from analysis.statistics import Estimate
from tests.docs.pages import ROOT
from tests.docs.tables import (
    as_shown,
    difference_of,
    estimate_of,
    over_scenes,
    rows_of,
    tenths,
)
from tests.docs.test_figures import geometric_mean, said


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
        ("README.md", "few and clean ", r" \(means over the scenes"),
        ("docs/guide/sampler.md", r"proportion to their true error, takes \[", r"\]"),
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
