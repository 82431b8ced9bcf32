import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.exploration_map import heat_maps, tables
from analysis.exploration_map import speedup as speedup_module
from analysis.exploration_map.__main__ import main, write_map
from analysis.exploration_map.final_errors import main as final_errors_main
from analysis.exploration_map.heat_maps import cell_text
from analysis.exploration_map.runs import (
    BASE,
    ERRORS,
    SAMPLERS,
    SCORING,
    SETTING,
    at_base,
    read_table,
    run_time,
)
from analysis.exploration_map.speedup import Comparison, Curves, ratio_of_means
from analysis.exploration_map.tables import setting_name, speedup_table, speedups

STEPS = np.arange(10, 1001, 10)


def falling(rate: float, *, steps: np.ndarray = STEPS, seeds: int = 1) -> Curves:
    """exp(-rate * time): in the logarithm a straight line, so that interpolation is exact."""
    return Curves(np.tile(steps, (seeds, 1)), np.tile(np.exp(-rate * steps), (seeds, 1)))


def rows_of(rates: dict[str, float], *, seeds: int = 2, **knobs: float) -> pd.DataFrame:
    """Runs of one setting without and with reuse (half of the batches); a rate per sampler."""
    frames = []
    for sampler, rate in rates.items():
        for reuse in (False, True):
            for seed in range(seeds):
                generated = STEPS // 2 if reuse else STEPS
                error = np.exp(-rate * STEPS)
                frames.append(
                    pd.DataFrame(
                        {
                            **{knob: BASE[knob] for knob in SETTING},
                            **knobs,
                            "sampler": sampler,
                            "reuse": reuse,
                            "seed": seed,
                            "step": STEPS,
                            "generated_batches": generated,
                            "scored_batches": 0 if sampler == "uniform" else generated,
                            "error_tail": error,
                            "error_uniform": error[::-1] if sampler == "uniform" else error,
                        }
                    )
                )
    return pd.concat(frames, ignore_index=True)


def all_samplers(rate: float) -> dict[str, float]:
    return {"uniform": 0.004, **dict.fromkeys(SAMPLERS, rate)}


def test_run_time_counts_steps_batches_and_scores() -> None:
    rows = pd.DataFrame(
        {"step": [10, 20], "generated_batches": [10, 12], "scored_batches": [9, 11]}
    )
    assert run_time(rows, cost_ratio=3.0, scoring=0.5).tolist() == [44.5, 61.5]


@pytest.mark.parametrize(("rate", "expected"), [(0.008, 2.0), (0.002, 0.5), (0.0044, 1.1)])
def test_ratio_of_exponentials_is_that_of_their_rates(rate: float, expected: float) -> None:
    ratios = ratio_of_means(falling(0.004), falling(rate), np.arange(1))
    assert ratios.time == pytest.approx(expected, rel=0.01)
    assert ratios.error == pytest.approx(math.exp((rate - 0.004) * 990), rel=0.03)
    assert not ratios.bound


def test_errors_are_compared_after_equal_time() -> None:
    """The faster learner is run for half as long: what comes later does not count."""
    short = falling(0.008, steps=STEPS / 2)
    ratios = ratio_of_means(falling(0.004), short, np.arange(1))
    assert ratios.time == pytest.approx(2.0, rel=0.02)
    assert ratios.error == pytest.approx(math.exp(0.004 * 495), rel=0.03)


def test_an_early_dip_is_not_yet_the_level() -> None:
    """What counts is the time from which the error stays down."""
    dipping = np.where((STEPS >= 200) & (STEPS < 300) | (STEPS >= 600), 0.1, 1.0)
    flat = Curves(STEPS[None], np.full((1, len(STEPS)), 0.5))
    ratio = ratio_of_means(flat, Curves(STEPS[None], dipping[None]), np.arange(1)).time
    assert ratio == pytest.approx(990 / 600, rel=0.02)


def test_who_is_ahead_at_the_first_test_is_a_bound() -> None:
    flat = Curves(STEPS[None], np.full((1, len(STEPS)), 0.5))
    lower = Curves(STEPS[None], np.full((1, len(STEPS)), 0.4))
    assert ratio_of_means(flat, lower, np.arange(1)).bound
    assert ratio_of_means(lower, flat, np.arange(1)).time < 1


def test_seeds_are_averaged_and_resampled_together() -> None:
    """Seed 1 makes both methods' errors ten times as large, which their ratio does not show."""
    rows = rows_of({"uniform": 0.004, "loss_greedy": 0.008}, seeds=3)
    rows.loc[rows["seed"] == 1, "error_tail"] *= 10
    found = Comparison(rows, "loss_greedy", False, 1e6).speedup()  # scoring costs nothing beside
    assert found.speedup == pytest.approx(2.0, rel=0.01)
    assert (found.low, found.high) == pytest.approx((found.speedup, found.speedup))


def test_the_interval_holds_what_the_seeds_leave_open() -> None:
    rows = rows_of({"uniform": 0.004, "loss_greedy": 0.004}, seeds=4)
    better = (rows["sampler"] == "loss_greedy") & (rows["seed"] < 2)
    worse = (rows["sampler"] == "loss_greedy") & (rows["seed"] >= 2)
    rows.loc[better, "error_tail"] *= 0.5
    rows.loc[worse, "error_tail"] *= 1.5
    found = Comparison(rows, "loss_greedy", False, 1e6).speedup()
    assert found.low < 0.9
    assert found.high > 1.1


@pytest.mark.parametrize("seeds", [3, 5])
def test_the_interval_is_as_wide_as_students(seeds: int) -> None:
    """Of curves a exp(-0.008 t) against exp(-0.004 t): ln of the ratio falls by ln a / (0.004 T).

    The plain bootstrap's is 0.37 of it with three seeds, 0.63 with five.
    """
    rows = rows_of({"uniform": 0.004, "loss_greedy": 0.008}, seeds=seeds)
    explored = rows["sampler"] == "loss_greedy"
    widths = []
    for drawn in np.random.default_rng(seeds).normal(0, 0.01, (12, seeds)):
        noisy = rows.copy()
        noisy.loc[explored, "error_tail"] *= np.exp(drawn[rows.loc[explored, "seed"]])
        found = Comparison(noisy, "loss_greedy", False, 1e6).speedup()
        students = 2 * stats.t.ppf(0.975, seeds - 1) * stats.sem(drawn) / (0.004 * 990)
        widths.append(math.log(found.high / found.low) / students)
    assert np.mean(widths) == pytest.approx(1.0, abs=0.06)


def test_one_seed_decides_nothing() -> None:
    found = Comparison(rows_of(all_samplers(0.008), seeds=1), "loss_greedy", False, 1.0).speedup()
    assert (found.low, found.high) == (0.0, math.inf)


@pytest.mark.parametrize(("reuse", "expected"), [(False, 11.0), (True, 12.0)])
def test_scoring_may_cost_what_the_steps_saved_cost(reuse: bool, expected: float) -> None:
    """In half the steps: N (1 + g r) = N/2 (1 + g (r + s)), g = 1 or 1/2, r = 10."""
    comparison = Comparison(rows_of(all_samplers(0.008)), "loss_greedy", reuse, 10.0)
    assert comparison.break_even_scoring() == pytest.approx(expected, rel=0.03)


def test_break_even_of_those_that_never_and_always_win() -> None:
    slower = Comparison(rows_of(all_samplers(0.002)), "loss_greedy", False, 10.0)
    assert slower.break_even_scoring() == 0.0
    rows = rows_of(all_samplers(0.008))
    rows.loc[rows["sampler"] == "uniform", "error_tail"] = 2.0
    assert Comparison(rows, "loss_greedy", False, 1e6).break_even_scoring() == math.inf


def test_expensive_scoring_slows_exploration_down() -> None:
    """As fast per step, loss x step costs 1.4 of a step and a batch 0.6: half as fast."""
    rows = rows_of({"uniform": 0.004, "loss_step_greedy": 0.004})
    found = Comparison(rows, "loss_step_greedy", False, 0.4).speedup()
    assert found.speedup == pytest.approx(0.5, rel=0.02)


def test_a_missing_method_is_named() -> None:
    with pytest.raises(ValueError, match="no run of 'uniform' with reuse"):
        Comparison(rows_of({"loss_greedy": 1.0}), "loss_greedy", True, 1.0).speedup()


def test_few_dimensions_are_at_the_base_with_as_many_active_variables() -> None:
    table = pd.concat(
        [
            rows_of({"uniform": 1.0}, seeds=1),
            rows_of({"uniform": 1.0}, seeds=1, dimensions=2, active=2),
            rows_of({"uniform": 1.0}, seeds=1, active=2),
            rows_of({"uniform": 1.0}, seeds=1, volume=0.1),
        ]
    )
    assert sorted(at_base(table, {"dimensions"})["dimensions"].unique()) == [2, 8]
    assert sorted(at_base(table, {"active"})["active"].unique()) == [2, 4]
    assert at_base(table, set())["volume"].unique().tolist() == [0.01]


@pytest.mark.parametrize(
    ("ratio", "low", "high", "bound", "text"),
    [
        (1.84, 1.2, 2.0, False, "1.8"),
        (1.84, 0.9, 2.0, False, "(1.8)"),
        (2.13, 2.0, 3.0, True, "≥2.1"),
        (0.42, 0.1, 0.9, True, "≤0.42"),
        (23.4, 20, 30, False, "23"),
    ],
)
def test_cells(ratio: float, low: float, high: float, bound: bool, text: str) -> None:
    assert cell_text({"speedup": ratio, "low": low, "high": high, "bound": bound}) == text


def test_settings_are_named_by_what_differs() -> None:
    knobs = {knob: BASE[knob] for knob in SETTING}
    assert setting_name(knobs) == "base"
    changed = {**knobs, "volume": 0.001, "hidden_features": 16.0}
    assert setting_name(changed) == "volume 0.001, hidden features 16"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer resamples, cost ratios, errors and maps than there are."""
    monkeypatch.setattr(speedup_module, "RESAMPLES", 5)
    monkeypatch.setattr(tables, "COST_RATIOS", (1.0, 10.0))
    monkeypatch.delitem(ERRORS, "error_uniform")
    monkeypatch.setattr(heat_maps, "PAIRS", heat_maps.PAIRS[:1])


@pytest.mark.usefixtures("small")
def test_the_table_has_a_row_per_setting_and_a_column_per_sampler() -> None:
    table = pd.concat([rows_of(all_samplers(0.008)), rows_of(all_samplers(0.002), volume=0.1)])
    found = speedups(table)
    assert len(found) == 2 * 2 * 2 * len(SAMPLERS)  # settings, cost ratios, kinds of reuse
    shown = speedup_table(found, error="error_tail", reuse=False)
    assert [row[0].text for row in shown.rows] == ["base", "volume 0.1"]
    greedy = 1 + list(SAMPLERS).index("loss_greedy")
    assert [row[greedy].text for row in shown.rows] == ["1.9", "0.48"]  # 11 / 11.35 of 2 and 0.5


@pytest.mark.usefixtures("small")
def test_everything_is_drawn(tmp_path: Path) -> None:
    parts = [rows_of(all_samplers(0.008)), rows_of(all_samplers(0.002), volume=0.1)]
    parts.append(rows_of(all_samplers(0.003), dimensions=2, active=2))
    pd.concat(parts).to_csv(tmp_path / "exploration_map.csv", index=False)
    files = write_map(tmp_path, tmp_path / "map")
    assert all(file.stat().st_size > 1000 for file in files)
    names = {file.name for file in files}
    assert {"error_tail_dimensions_volume.png", "error_tail_knobs.svg", "speedups.tex"} <= names
    cells = (tmp_path / "map" / "error_tail_dimensions_volume.svg").read_text()
    assert all(f">{text}<" in cells for text in ("1.9", "0.48"))


def test_what_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 1
    assert "python -m ngi.studies.exploration_map writes it" in capsys.readouterr().err
    rows_of({"uniform": 1.0}).drop(columns="noise").to_csv(tmp_path / "exploration_map.csv")
    with pytest.raises(ValueError, match="it lacks \\['noise'\\]"):
        read_table(tmp_path)


def test_final_errors_are_those_of_the_last_step_paired_by_seed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seed 1 has ten times the error of seed 0 with both samplers: half as much in each pair."""
    monkeypatch.setitem(SCORING, "predicted", 1.2)
    rows = rows_of({"uniform": 0.004, "predicted": 0.004})
    rows.loc[rows["sampler"] == "predicted", "error_tail"] *= 0.5
    rows.loc[rows["seed"] == 1, "error_tail"] *= 10
    rows["lit"] = 0.25
    rows[rows["reuse"]].to_csv(tmp_path / "exploration_map.csv", index=False)
    assert final_errors_main([str(tmp_path), "--output", str(tmp_path / "final.md")]) == 0
    uniform, predicted = (tmp_path / "final.md").read_text().splitlines()[-2:]
    last = math.exp(-4.0) * 5.5
    assert [cell.strip() for cell in uniform.split("|")[1:7]] == [
        *("base", "1000", "yes", "uniform", "2", "0.250 ± 0.000")
    ]
    assert f" {last:.3f} ± " in uniform
    assert f" {last / 2:.4f} ± " in predicted
    assert "-50.0 ± 0.0 %" in predicted
    assert uniform.split("|")[-2].strip() == ""
    half = math.log(2) / 0.004  # steps to half of the error
    expected = 990 / (990 - half) * 6 / 6.6
    assert float(predicted.split("|")[-3]) == pytest.approx(expected, abs=0.06)


def test_final_errors_of_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert final_errors_main([str(tmp_path), "--output", str(tmp_path / "final.md")]) == 1
    assert "there is no such file" in capsys.readouterr().err


def test_final_errors_can_be_compared_with_another_folders_uniform_sampling(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, rates in (
        ("steady", {"uniform": 0.001, "predicted": 0.009}),
        ("by_loss", {"uniform": 0.002, "predicted": 0.003}),
    ):
        rows = rows_of(rates)
        rows["lit"] = 0.25
        (tmp_path / name).mkdir()
        rows[rows["reuse"]].to_csv(tmp_path / name / "exploration_map.csv", index=False)
    words = [str(tmp_path / "by_loss"), "--output", str(tmp_path / "final.md"), "--against"]
    assert final_errors_main([*words, str(tmp_path / "steady")]) == 0
    shown = [
        [cell.strip() for cell in line.split("|")]
        for line in (tmp_path / "final.md").read_text().splitlines()[-3:]
    ]
    assert [cells[4] for cells in shown] == ["uniform", "uniform, reuse as here", "predicted loss"]
    for cells, rate in zip(shown[1:], (0.002, 0.003), strict=True):
        assert cells[-5] == f"{100 * math.expm1(1000 * (0.001 - rate)):.1f} ± 0.0 %"
        assert float(cells[-3]) == pytest.approx(rate / 0.001, abs=0.06)
    whole = pd.read_csv(tmp_path / "steady" / "exploration_map.csv")
    for part, problem in (
        ("seed == 0", "no uniform sampling to compare with: base, with reuse, seed 1"),
        ("step < 900", "runs of 1000 steps cannot be compared with runs of 890"),
    ):
        whole.query(part).to_csv(tmp_path / "steady" / "exploration_map.csv", index=False)
        assert final_errors_main([*words, str(tmp_path / "steady")]) == 1
        assert problem in capsys.readouterr().err
