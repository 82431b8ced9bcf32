"""What the page of the learner says of runs that end on stored patches is what was measured."""

import numpy as np
import pandas as pd
import pytest
import torch

from ngi.reuse import Epochs, FixedProbability
from tests.docs.pages import ROOT
from tests.docs.tables import over_scenes, rows_of, tenths
from tests.docs.test_figures import geometric_mean, said

PAGE, SECTION = "docs/learner/README.md", "Nothing new at the end"
COLUMNS = ["hard", "hard_tail", "uniform", "uniform_tail"]


@pytest.fixture
def runs() -> pd.DataFrame:
    found = pd.read_csv(ROOT / "docs/learner/stored_alone.csv")
    for frames in ("hard", "uniform"):
        found[frames] = geometric_mean(found, frames)
    return found


def means_of(before: pd.DataFrame, now: pd.DataFrame) -> list[str]:
    means = [over_scenes(before[column], now[column]) for column in COLUMNS]
    return [f"{tenths(each.mean)} ± {100 * each.half_width:.1f}" for each in means]


def pairs_of(runs: pd.DataFrame, budget: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """With new patches to the end, and without."""
    of = runs[runs.budget == budget].set_index(["stored_alone", "scene", "seed"]).sort_index()
    return of.loc[0.0], of.loc[0.2]


def test_the_table_is_of_every_run(runs: pd.DataFrame) -> None:
    rows = iter(rows_of(PAGE, SECTION)[2:])
    for budget in runs.budget.unique():
        before, now = pairs_of(runs, budget)
        assert before.index.equals(now.index)
        for run, changes in (now[COLUMNS] / before[COLUMNS] - 1).iterrows():
            counts = [
                each.loc[run, name]
                for name in ("steps", "patches_traced")
                for each in (before, now)
            ]
            assert next(rows) == [*(f"{count:,}" for count in counts), *map(tenths, changes)]
        assert next(rows) == ["", "", "", "", *means_of(before, now)]


def test_the_sentences_are_what_the_table_says(runs: pd.DataFrame) -> None:
    small, scarce = (
        [text.lstrip("−").replace(" ±", " % ±") for text in means_of(*pairs_of(runs, budget))]
        for budget in ("small", "scarce")
    )
    number = r"(\d+\.\d % ± \d+\.\d)"
    words = (
        rf"takes {number} off hard frames and {number} off uniform ones after the same ten "
        rf"minutes, {number} and {number} off their worst pixels"
    )
    assert said(PAGE, words) == (scarce[0], scarce[2], scarce[1], scarce[3])
    words = rf"after as many steps on as many patches, it is {number} and {number}"
    assert said(PAGE, words) == (small[0], small[2])
    late = runs[runs.budget == "scarce"].run_seconds.max() - 600
    assert said(PAGE, r"ended up to (\d+) s after the budget") == (f"{late:.0f}",)
    said("CHANGELOG.md", rf"takes {scarce[0]} off hard frames after the same ten minutes")


def test_how_many_pairs_have_less_error(runs: pd.DataFrame) -> None:
    by_pair = runs.set_index(["budget", "scene", "stored_alone"])[COLUMNS].unstack()
    less = [int((by_pair[column][0.2] < by_pair[column][0.0]).sum()) for column in COLUMNS[:2]]
    said(PAGE, "nine of the ten pairs have less error on hard frames and on their worst pixels")
    assert (less, len(by_pair)) == ([9, 9], 10)


def times_trained_on(stored_alone: float, *, steps: int = 2000, batch: int = 8) -> np.ndarray:
    """How often each patch of a run at 32 samples per pixel is, the oldest first."""
    policy = FixedProbability.by_samples(
        bootstrap_batches=4, times_at_32=12.5, samples_per_pixel=32, stored_alone=stored_alone
    )
    generator, waiting = torch.Generator().manual_seed(0), torch.zeros(0, dtype=torch.int64)
    times = torch.zeros(0)
    for step in range(steps):
        generated = len(times) // batch
        probability = policy.probability(
            policy.init(), generated_batches=generated, store_size=len(times), store_capacity=10**6
        )
        reused = policy.reuses(probability, draw=0, batches=step, generated_batches=generated)
        if reused or step >= (1 - stored_alone) * steps:
            drawn, waiting = Epochs().draw(times, waiting, batch, generator)
            times[drawn] += 1
        else:
            times = torch.cat([times, torch.ones(batch)])
    return times.numpy()


def test_how_often_patches_were_trained_on_is_counted() -> None:
    before, now = times_trained_on(0.0), times_trained_on(0.2)
    tenth, fifth = len(before) // 10, len(before) // 5
    words = (
        r"first tenth of all patches was trained on (\d+) times, the last fifth ([\d.]+) times, "
        r"now (\d+) and ([\d.]+) times"
    )
    first = [f"{times[:tenth].mean():.0f}" for times in (before, now)]
    last = [f"{times[-fifth:].mean():.1f}" for times in (before, now)]
    assert said(PAGE, words) == (first[0], last[0], first[1], last[1])
    assert len(now) / len(before) > 0.97
