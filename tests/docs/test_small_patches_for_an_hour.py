"""What docs/exploration-ceiling/small-patches.md says of an hour's budget is what its runs say."""

import numpy as np
import pandas as pd
import pytest

from tests.docs.pages import ROOT
from tests.docs.tables import as_shown, ends_of, over_scenes, rows_of, tenths
from tests.docs.test_figures import geometric_mean, said
from tests.docs.test_from_buffers import FOLDER, FRAMES, errors_of

PAGE = "docs/exploration-ceiling/small-patches.md"
SECTION = "For an hour"
HOURS = "hour_same_time.csv"


def curves_of(runs: pd.DataFrame) -> pd.DataFrame:
    """Of one scene, over its seeds: fewest steps, hard and uniform errors, by the evaluation."""
    number = runs.groupby(["seed", "commit"]).cumcount()
    logs = {frames: np.log(geometric_mean(runs, frames)) for frames in FRAMES}
    errors = np.exp(pd.DataFrame(logs).groupby(number).mean())
    return errors.assign(step=runs.step.groupby(number).min())


def as_many_steps(error: float, errors: pd.Series, steps: pd.Series) -> str:
    """Where the curve of errors falls to this one, both axes logarithmic."""
    falling = errors.cummin()
    if error < falling.iloc[-1]:
        return f"more than {steps.iloc[len(falling) - 1]:,}"
    logs = np.interp(-np.log(error), -np.log(falling), np.log(steps.iloc[: len(falling)]))
    return f"{round(float(np.exp(logs)), -2):,.0f}"


def rows_of_hours() -> list[list[str]]:
    """One for each evaluation of each scene."""
    small = pd.read_csv(FOLDER / "hour_small_patches.csv")
    large = pd.read_csv(FOLDER / "hour_h200.csv").query("method == 'ours_uniform'")
    rows = []
    for scene, own in small.groupby("scene"):
        base = large[large.scene == scene]
        ours, uniform = curves_of(own), curves_of(base)
        for number, (step, patches) in enumerate(zip(own.step, own.patches_traced, strict=True)):
            before, now = uniform.loc[number], ours.loc[number]
            assert abs(step / before.step - 1) < 0.001
            needed = as_many_steps(now.hard, uniform.hard, uniform.step)
            changes = [tenths(now[frames] / before[frames] - 1) for frames in FRAMES]
            absolute = [f"{each.hard:.4f}" for each in (before, now)]
            rows.append([f"{step:,}", f"{patches:,}", *absolute, *changes, needed])
    return rows


def test_an_hour_s_errors_and_steps_are_what_the_runs_say() -> None:
    assert rows_of(PAGE, SECTION)[2:] == rows_of_hours()


def test_how_many_steps_it_saves_is_what_the_runs_say() -> None:
    rows = rows_of_hours()
    scenes = pd.read_csv(FOLDER / "hour_small_patches.csv").scene
    row = [cells for scene, cells in zip(scenes, rows, strict=True) if scene == "living-room"][-1]
    words = r"after ([\d,]+) steps small patches have the error .*? needs ((?:more than )?[\d,]+)"
    found = said(PAGE, words)
    assert found == (row[0], row[-1])
    assert said(PAGE, r"has above, ([\d.]+) % after as many steps") == (row[4].lstrip("−"),)


def test_what_looking_takes_is_what_the_run_says() -> None:
    runs = pd.read_csv(FOLDER / "hour_small_patches.csv").query("scene == 'living-room'")
    last = runs.iloc[-1]
    share = f"{100 * last.explore_seconds / last.run_seconds:.1f}"
    assert said(PAGE, r"looking took ([\d.]+) % of the run time on living-room") == (share,)


def rows_of_the_clock(scene: str) -> list[list[str]]:
    """After each quarter of the hour."""
    runs = pd.read_csv(FOLDER / HOURS)
    runs = runs[runs.scene == scene].set_index("method")
    uniform, small = (runs.loc[f"ours_{name}"] for name in ("uniform", "small_patches"))
    assert len(uniform) == len(small) == 12
    rows = []
    for number in (2, 5, 8, 11):
        before, now = (method.iloc[[number]] for method in (uniform, small))
        errors = zip(errors_of(before), errors_of(now), strict=True)
        changes = [tenths(b.iloc[0] / a.iloc[0] - 1) for a, b in errors]
        steps = [f"{method.step.iloc[0]:,}" for method in (before, now)]
        seconds = [method.run_seconds.iloc[0] for method in (before, now)]
        assert seconds == pytest.approx([300 * (number + 1)] * 2, rel=0.02)
        shown = f"{300 * (number + 1):,}"
        rows.append([shown, *steps, f"{now.patches_traced.iloc[0]:,}", *changes])
    return rows


SCENES = (
    *("sphere-caustic", "living-room", "bathroom", "veach-egg"),
    *("bedroom", "spaceship", "veach-door"),
)
"""Whose hours by the clock are there, in the order of the table."""


def test_what_an_hour_of_the_clock_gives_is_what_its_runs_say() -> None:
    by_scene = {scene: rows_of_the_clock(scene) for scene in SCENES}
    shown = [row for rows in by_scene.values() for row in rows]
    assert rows_of(PAGE, "After the same hour")[2:] == shown
    *_, before, _, _, _ = by_scene["sphere-caustic"][-2]
    assert said(PAGE, r"it was ([\d.]+) % less after three quarters") == (before.lstrip("−"),)
    ends = {scene: [each.lstrip("−") for each in rows[-1][-4:]] for scene, rows in by_scene.items()}
    order = ("bathroom", "sphere-caustic", "living-room")
    hard, pixels = ([ends[scene][column] for scene in order] for column in (0, 1))
    words = (
        r"is ([\d.]+) % less error on hard frames of bathroom, ([\d.]+) % less on sphere-caustic "
        r"and ([\d.]+) % on living-room, and ([\d.]+), ([\d.]+) and ([\d.]+) % less on their worst"
    )
    assert said(PAGE, words) == (*hard, *pixels)
    assert said(PAGE, r"after as many steps, is ([\d.]+) % here") == (hard[2],)
    words = (
        r"end with ([\d.]+) % less (?:error on hard frames of|on) bathroom[^,]*, "
        r"(?:with )?([\d.]+) % (?:less )?on sphere-caustic and (?:with )?([\d.]+) % on living-room"
    )
    more, less = by_scene["veach-egg"][-1][-4:-2]
    assert said(PAGE, r"end ([\d.]+) % higher, their worst pixels ([\d.]+) % lower") == (
        more.lstrip("+"),
        less.lstrip("−"),
    )
    bedroom = [each.lstrip("−") for each in by_scene["bedroom"][-1][-4:-2]]
    assert said(PAGE, r"small patches end ([\d.]+) % lower on both") * 2 == tuple(bedroom)
    spaceship = [each.lstrip("−") for each in by_scene["spaceship"][-1][-4:-2]]
    ended = said(PAGE, r"the hour and end ([\d.]+) % lower, ([\d.]+) % on the worst pixels")
    assert ended == tuple(spaceship)
    door = by_scene["veach-door"][-1][-4].lstrip("−")
    for page in ("README.md", "CHANGELOG.md", "docs/exploration-ceiling/README.md"):
        assert said(page, words) == tuple(hard)
        assert f"{more.lstrip('+')} % more" in (ROOT / page).read_text()
        assert said(page, r"on bedroom with ([\d.]+) % less") == (bedroom[0],)
        assert said(page, r"on spaceship with ([\d.]+) % less") == (spaceship[0],)
        assert said(page, r"on veach-door with ([\d.]+) % less") == (door,)


def test_the_mean_over_the_scenes_is_that_of_their_ends() -> None:
    uniform, small = ends_of(FOLDER / HOURS)
    assert sorted(uniform.index.get_level_values("scene")) == sorted(SCENES)
    found = [over_scenes(a, b) for a, b in zip(*map(errors_of, (uniform, small)), strict=True)]
    shown = [as_shown(each).removesuffix(" (7)").replace(" %", "") for each in found]
    number = r"(−[\d.]+) % (± [\d.]+)"
    said_of = said(PAGE, rf"it is {number} and {number}, and {number} and {number} on uniform")
    assert [" ".join(pair) for pair in zip(said_of[::2], said_of[1::2], strict=True)] == shown
    hard, pixels = (each.lstrip("−").replace(" ±", " % ±") for each in shown[:2])
    overview = said("docs/exploration-ceiling/README.md", r"more on veach-egg, ([\d.± %]+) less in")
    assert overview == (hard,)
    words = r"the seven (?:with )?([\d.± %]+) less,? and ([\d.± %]+) less on the worst pixels"
    for page in ("README.md", "CHANGELOG.md"):
        assert said(page, words) == (hard, pixels)


def test_what_veach_door_gains_over_the_hour_is_what_its_runs_say() -> None:
    runs = pd.read_csv(FOLDER / HOURS).set_index(["scene", "method"])
    uniform, small = (runs.loc[("veach-door", f"ours_{n}")] for n in ("uniform", "small_patches"))
    pairs = zip(errors_of(uniform), errors_of(small), strict=True)
    changes = [[b / a - 1 for a, b in zip(*pair, strict=True)] for pair in pairs]
    assert max(map(max, changes)) < 0  # "by all four measures at every evaluation"
    hard, pixels, *_ = ([tenths(of[number]).lstrip("−") for number in (0, -1)] for of in changes)
    words = r"evaluation, by ([\d.]+) % after five minutes and ([\d.]+) % at the end, "
    assert said(PAGE, words + r"([\d.]+) and ([\d.]+) % on the worst") == (*hard, *pixels)


def test_when_uniform_sampling_s_end_is_reached_is_what_the_runs_say() -> None:
    runs = pd.read_csv(FOLDER / HOURS)
    runs["hard"] = geometric_mean(runs, "hard")
    minutes = {}
    for scene, own in runs.groupby("scene"):
        uniform, small = (
            own[own.method == f"ours_{name}"] for name in ("uniform", "small_patches")
        )
        reached = small.hard <= uniform.hard.iloc[-1]
        if reached.any():
            minutes[scene] = f"{small.run_seconds[reached].min() / 60:.0f}"
    assert set(SCENES) - set(minutes) == {"veach-egg"}  # "on veach-egg it is not"
    words = (
        r"after (\d+) minutes on bathroom, (\d+) on living-room and (\d+) on sphere-caustic, "
        r"at the very end on bedroom, spaceship and veach-door, and on veach-egg it is not"
    )
    order = ("bathroom", "living-room", "sphere-caustic")
    late = ("bedroom", "spaceship", "veach-door")
    assert [minutes.pop(scene) for scene in late] == ["60"] * 3
    assert said(PAGE, words) == tuple(minutes[scene] for scene in order)
    assert said("README.md", r"after (\d+) to (\d+) minutes the error") == (
        min(minutes.values()),
        max(minutes.values()),
    )


def test_what_looking_takes_of_an_hour_is_what_the_runs_say() -> None:
    _, small = ends_of(FOLDER / HOURS)
    shares = 100 * small.explore_seconds / small.run_seconds
    expected = f"{shares.min():.1f}", f"{shares.max():.1f}"
    assert said(PAGE, r"Looking takes ([\d.]+) to ([\d.]+) % of the time") == expected
