"""The ceilings at the end of one core's hour are those of their runs."""

import pandas as pd
import pytest

from tests.docs.pages import ROOT
from tests.docs.tables import rows_of, tenths
from tests.docs.test_figures import geometric_mean, said

ONE_CORE = {"bathroom": (2384, 5120), "sphere-caustic": (2048, 4416), "spaceship": (2760, 5952)}
"""Patches chosen, and the pool that they are chosen from."""


def changes_of_one_core(scene: str) -> list[list[str]]:
    """Of the oracle, the sharper one and all patches against uniform choice."""
    every = pd.read_csv(ROOT / "docs/exploration-ceiling/hour_ceiling_one_core.csv")
    runs = every[every.scene == scene].set_index(["patches", "choice"])
    chosen, pool = ONE_CORE[scene]
    columns = ["hard_error", "hard_tail", "uniform_error", "uniform_tail"]
    base = runs.loc[(chosen, "uniform"), columns]
    others = ((chosen, "oracle"), (chosen, "oracle_cubed"), (pool, "uniform"))
    return [[tenths(x) for x in runs.loc[run, columns] / base - 1] for run in others]


def test_the_ceilings_of_an_hour_on_one_core_are_what_the_runs_say() -> None:
    page, small = (f"docs/exploration-ceiling/{name}.md" for name in ("README", "small-patches"))
    changes = {scene: changes_of_one_core(scene) for scene in ONE_CORE}
    second = 2 + 6 + 2  # after the table of the other two scenes, and two lines of its own
    shown = rows_of(page, "The end of an hour")[second : second + 9]
    assert shown == [row for rows in changes.values() for row in rows]
    oracle, sharper = ([rows[n][0].lstrip("−") for rows in changes.values()] for n in (0, 1))
    words = r"core it is ([\d.]+) % on bathroom, ([\d.]+) % on sphere-caustic and nothing on spaces"
    assert said(page, words) == tuple(oracle[:2])
    words = r"nothing on spaceship; for a sharper choice ([\d.]+), ([\d.]+) and nothing\*\*"
    assert said(page, words) == tuple(sharper[:2])
    assert changes["spaceship"][0][0][0] == "+"
    assert float(sharper[2]) == 0
    found = said(page, r"on bathroom\]\S+ ([\d.]+) % where in proportion it gains ([\d.]+)\.")
    assert found == (sharper[0], oracle[0])
    words = (
        r"and ([\d.]+) % off bathroom, ([\d.]+) if .*?, ([\d.]+) and ([\d.]+) off sphere-caustic"
    )
    assert said(small, words) == (oracle[0], sharper[0], oracle[1], sharper[1])


@pytest.mark.parametrize("scene", ONE_CORE)
def test_the_ceiling_of_one_core_has_the_steps_and_patches_of_the_hour(scene: str) -> None:
    folder = ROOT / "docs/exploration-ceiling"
    every = pd.read_csv(folder / "hour_ceiling_one_core.csv")
    (steps,) = set(every[every.scene == scene].steps)
    hours = pd.read_csv(folder / "hour_same_time.csv")
    last = hours[hours.scene == scene].groupby("method").last()
    assert abs(last.step["ours_uniform"] - steps) <= 3
    assert last.patches_traced["ours_small_patches"] == 4 * ONE_CORE[scene][0]
    page = "docs/exploration-ceiling/README.md"
    ends = said(page, r"end the same hours with ([\d.]+), ([\d.]+) and ([\d.]+) % less error")
    error = geometric_mean(last, "hard")
    shown = ends[list(ONE_CORE).index(scene)]
    assert tenths(error["ours_small_patches"] / error["ours_uniform"] - 1) == f"−{shown}"
