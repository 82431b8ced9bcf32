"""The tables of docs/exploration-ceiling/small-patches.md are those of its runs."""

import pandas as pd
import pytest

from analysis.statistics import estimate
from tests.docs import test_from_buffers as from_buffers
from tests.docs.tables import rows_of, tenths
from tests.docs.test_figures import geometric_mean, said
from tests.docs.test_from_buffers import (
    FOLDER,
    FRAMES,
    changes_of,
    errors_of,
    last_of,
    less,
    mean_of,
    over_scenes,
    percent,
)

PAGE = "docs/exploration-ceiling/small-patches.md"
SMALL = "ours_small_patches"
SOBOL = "sobol_small_patches"
WHOLE = "uniform_seen_whole"  # patches of 32x32; the denoiser's border, all of SSIM's windows
OTHERS = (
    *(WHOLE, "uniform_small_patches", "uniform_small_patches_of_8", SOBOL),
    *("sobol_small_patches_mirrored", "looked_at_48"),
)
SAME_MACHINE = {  # runs with patches of 32x32 on the machine that has those of 16x16
    "living-room": "ours_predicted_from_buffers",
    "sphere-caustic": "uniform_again",
    "veach-egg": "sobol",
}


@pytest.fixture(scope="module")
def runs() -> pd.DataFrame:
    """With those of patches of 32x32; by method, scene and seed."""
    files = (FOLDER / name for name in ("small_patches.csv", "from_buffers.csv"))
    return last_of(pd.concat(map(pd.read_csv, files)).query("budget == 'scarce'"))


def rows_of_runs(runs: pd.DataFrame) -> list[list[str]]:
    """One for each scene, then one over the scenes."""
    columns = changes_of(runs, SMALL, "ours_uniform")
    own = runs.loc[SMALL]
    base = runs.loc["ours_uniform"].loc[own.index]
    assert (own.patches_traced == 4 * base.patches_traced).all()
    rows = []
    for scene in own.index.unique("scene"):
        here = own.loc[scene]
        (steps,), (patches,) = here.step.unique(), here.patches_traced.unique()
        errors = (geometric_mean(all_runs.loc[scene], "hard").mean() for all_runs in (base, own))
        means = (mean_of(changes.loc[scene]) for changes in columns)
        looking = f"{100 * here.explore_seconds.sum() / here.run_seconds.sum():.1f}"
        rows.append([f"{steps:,}", f"{patches:,}", *(f"{e:.4f}" for e in errors), *means, looking])
    return [*rows, ["", "", "", "", *over_scenes(columns), ""]]


def rows_of_other_runs(runs: pd.DataFrame) -> list[list[str]]:
    """Of each kind one for each scene; one over the scenes where there are all."""
    rows = []
    for method in OTHERS:
        columns = changes_of(runs, method, "ours_uniform")
        scenes = runs.loc[method].index.unique("scene")
        rows += [[mean_of(changes.loc[scene]) for changes in columns] for scene in scenes]
        if method == SOBOL:
            rows.append(over_scenes(columns))
    return rows


def rows_of_small_runs(runs: pd.DataFrame) -> list[list[str]]:
    """Of `budget=small`, after the same time: steps, and small patches in per cent of large."""
    rows = []
    for scene in runs.loc[SOBOL].index.unique("scene"):
        large, small = (runs.loc[method].loc[[(scene, 0)]] for method in ("ours", SOBOL))
        errors = [geometric_mean(small, f) / geometric_mean(large, f) - 1 for f in FRAMES]
        steps = [f"{each.step.item()}" for each in (large, small)]
        rows.append([*steps, *(tenths(error.item()) for error in errors)])
    return rows


def rows_of_cheap_runs(runs: pd.DataFrame) -> list[list[str]]:
    """Of `budget=small`, after as many steps and paths, against ours as it is."""
    kinds = {"ours_seen_whole": 1, "ours_quarters": 4}  # so many patches for one of 32x32
    columns = {kind: changes_of(runs, kind, "ours_longer") for kind in kinds}
    traced = runs.patches_traced
    for kind, patches in kinds.items():
        assert (traced[kind] == patches * traced["ours_longer"]).all()
    scenes = traced["ours_longer"].index.unique("scene")
    return [[mean_of(c.loc[scene]) for c in columns[kind]] for scene in scenes for kind in kinds]


def rows_of_same_time(runs: pd.DataFrame) -> list[list[str]]:
    """What four places of each vector have after as long as patches of 32x32."""
    kinds = ("same_time_whole", "same_time_quarters")
    columns, steps = changes_of(runs, kinds[1], kinds[0]), runs.step
    return [
        [*(f"{steps[kind, scene, 0]}" for kind in kinds), *(mean_of(c.loc[scene]) for c in columns)]
        for scene in steps[kinds[0]].index.unique("scene")
    ]


def test_what_runs_end_with_is_what_their_table_says(runs: pd.DataFrame) -> None:
    shown = [[cell.strip("*") for cell in row] for row in rows_of(PAGE, "In runs")]
    assert shown[2:] == rows_of_runs(runs)


def test_what_small_patches_alone_gain_is_what_their_runs_say(runs: pd.DataFrame) -> None:
    shown = [[cell.strip("*") for cell in row] for row in rows_of(PAGE, "What of it is which")]
    assert shown[2:] == rows_of_other_runs(runs)


def test_what_small_patches_cost_where_samples_are_few_is_what_their_runs_say() -> None:
    evaluations = pd.read_csv(FOLDER / "small_patches.csv").set_index("budget")
    shown = rows_of(PAGE, "What more scene vectors cost")
    for budget, rows in (("small", shown[2:4]), ("machine", shown[6:])):
        assert rows == rows_of_small_runs(last_of(evaluations.loc[budget]))


def test_what_four_places_of_each_vector_gain_where_paths_are_cheap() -> None:
    runs = last_of(pd.read_csv(FOLDER / "small_patches.csv").query("budget == 'small'"))
    shown = rows_of(PAGE, "Where paths are cheap: four places of each scene vector")
    same_steps = rows_of_cheap_runs(runs)
    assert shown[2 : 2 + len(same_steps)] == same_steps
    assert shown[4 + len(same_steps) :] == rows_of_same_time(runs)


@pytest.mark.parametrize("page", ["README.md", "docs/guide/sampler.md", PAGE])
def test_what_is_said_of_all_runs_is_the_last_row(page: str, runs: pd.DataFrame) -> None:
    less_than = r"(\d+\.\d) % ± (\d+\.\d)"
    shown = said(
        page,
        rf"{less_than}(?:\]\([^)]+\))? less error on hard frames and {less_than} on uniform ones, "
        rf"{less_than} and {less_than} less on the worst 5 % of pixels",
    )
    hard, hard_tail, uniform, uniform_tail = rows_of_runs(runs)[-1][4:8]
    assert [*shown] == less([hard, uniform, hard_tail, uniform_tail])


def test_each_scene_has_less_of_each_error(runs: pd.DataFrame) -> None:
    (word,) = said(PAGE, r"the mean over (\w+) scenes\. On every scene all four are lower")
    changes = pd.concat(changes_of(runs, SMALL, "ours_uniform"), axis=1)
    assert (changes < 0).all(axis=None)
    assert (word, len(changes.index.unique("scene"))) == ("seven", 7)


def test_what_looking_and_whole_windows_add_is_what_the_runs_that_both_have_say(
    runs: pd.DataFrame,
) -> None:
    (shown,) = said(PAGE, r"Against the sequence alone it has (.+?) \(the mean over")
    added = (
        changes.groupby("scene").mean()
        for changes in changes_of(runs.query("seed == 0"), SMALL, SOBOL)
    )
    assert shown == ", ".join(map(percent, added))


def left_of(runs: pd.DataFrame) -> str:
    """What small patches have on hard frames against uniform sampling that sees patches whole."""
    hard = geometric_mean(runs, "hard")
    left = (hard[SMALL] / hard[WHOLE] - 1).dropna().groupby("scene").mean()
    return ", ".join(f"{tenths(change)} % on {scene}" for scene, change in left.items())


def test_what_is_left_against_uniform_sampling_that_sees_patches_whole(runs: pd.DataFrame) -> None:
    (shown,) = said(PAGE, r"that has both, small patches have (.+?) \(seed 0\)")
    assert shown == left_of(runs)
    assert set(runs.loc[WHOLE].index.get_level_values("seed")) == {0}


def test_what_all_windows_take_off_is_what_their_pairs_with_large_patches_say(
    runs: pd.DataFrame,
) -> None:
    cheap = last_of(pd.read_csv(FOLDER / "small_patches.csv").query("budget == 'small'"))
    pairs = ((runs, WHOLE, "ours_uniform"), (cheap, "ours_seen_whole", "ours_longer"))
    hard = pd.concat([changes_of(*pair)[0] for pair in pairs])
    least, most, word = said(PAGE, r"took (\S+) to (\S+) % off hard frames in the (\w+) pairs")
    assert [least, most] == [f"{-100 * change:.1f}" for change in (hard.max(), hard.min())]
    assert (word, len(hard)) == ("five", 5)


def test_intervals_over_seeds_have_no_0_in_them(runs: pd.DataFrame) -> None:
    scenes = said(PAGE, r"several seeds, on (\S+) and (\S+), which")
    for changes in changes_of(runs, SMALL, "ours_uniform")[:2]:
        of_scenes = {scene: estimate([*changes.loc[scene]]) for scene in scenes}
        assert all(e.n > 1 and e.mean + e.half_width < 0 for e in of_scenes.values())


def test_what_a_choice_of_large_patches_gains_is_what_its_page_says() -> None:
    shown = said(PAGE, r"gains (\d\.\d) % ± (\d\.\d) on hard frames and (\d\.\d) % ± (\d\.\d) on")
    row = from_buffers.rows_of_runs(from_buffers.of_runs("scarce"))[-1]
    assert [*shown] == less([row[3], row[5]])


def test_what_more_scene_vectors_cost_is_what_runs_on_one_machine_took(runs: pd.DataFrame) -> None:
    ratios = {
        scene: runs.run_seconds["uniform_small_patches", scene, 0]
        / runs.run_seconds[method, scene, 0]
        for scene, method in SAME_MACHINE.items()
    }
    shown = said(PAGE, r"took (\d+) % longer on living-room, (\d+) % on sphere-caustic and (\d+) %")
    assert [*shown] == [f"{100 * (ratios[scene] - 1):.0f}" for scene in SAME_MACHINE]


def test_windows_of_stored_patches_gain_what_their_table_says() -> None:
    runs = pd.read_csv(FOLDER / "quarter_windows.csv").set_index(["data", "step"])
    columns = zip(errors_of(runs.loc["whole"]), errors_of(runs.loc["windows"]), strict=True)
    table = pd.DataFrame([windows / whole - 1 for whole, windows in columns]).T
    shown = rows_of(PAGE, "Is it the noise of the gradients?")[2:]
    assert shown == [[tenths(change) for change in row] for row in table.to_numpy()]
