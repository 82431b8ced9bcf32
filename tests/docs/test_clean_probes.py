"""What the page of the learner says of clean patches is what was measured."""

import pandas as pd
import pytest

from tests.docs.pages import ROOT
from tests.docs.tables import rows_of
from tests.docs.test_figures import geometric_mean, said

PAGE, SECTION = "docs/learner/README.md", "With clean patches"


def test_the_table_is_of_every_run() -> None:
    runs = pd.read_csv(ROOT / "docs/learner/clean_probes.csv")
    rows = iter(rows_of(PAGE, SECTION)[2:])
    for _, run in runs.iterrows():
        errors = [run[name] for name in ("hard_error", "uniform_error", "seen", "held_out")]
        seconds = f"{run.processor_seconds:.0f}"
        assert next(rows) == [str(run.seed), *(f"{error:.4f}" for error in errors), seconds]


def test_the_sentences_are_what_the_runs_say() -> None:
    runs = pd.read_csv(ROOT / "docs/learner/clean_probes.csv")
    runs = runs.set_index(["variant", "seed"]).sort_index()
    whole = {frames: geometric_mean(runs, frames) for frames in ("hard", "uniform")}
    less = []
    for frames, errors in whole.items():
        assert errors.to_numpy() == pytest.approx(runs[f"{frames}_error"], rel=1e-4)
        ours = errors["ours"]
        assert abs(ours[1] / ours[0] - 1) < 0.01
        wide = errors["6×256 in place of 6×128"][0] / ours[0] - 1
        less.append(f"{-100 * wide:.1f}")
        others = errors.drop(["ours", "6×256 in place of 6×128"]) / ours[0] - 1
        assert (others > -0.01).all()
    assert said(PAGE, r"takes ([\d.]+) % off hard frames and ([\d.]+) % off uniform ones, for") == (
        *less,
    )
    not_seen = runs["held_out"]["6×256 in place of 6×128"][0] / runs["held_out"]["ours"][0]
    assert abs(not_seen - 1) < 0.01
