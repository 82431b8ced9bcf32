import json
import math

import numpy as np
import pytest

from analysis.effects import compare_on_scene, paired_effect, pool
from analysis.evidence import ALL_SCENES, MORE_THAN_MOST_SEEDS, Verdict, decide, of_tests
from analysis.methods import name_methods
from analysis.pairs import pair_runs
from analysis.report import main
from analysis.runs import METRICS, Run, find_runs


def runs_below(folder) -> list[Run]:  # type: ignore[no-untyped-def]
    return name_methods(find_runs(folder)[0])


def compare(folder, scene: str = "living-room"):  # type: ignore[no-untyped-def]
    return compare_on_scene(runs_below(folder), scene, "active_exploration", "uniform")


def test_less_error_in_the_worst_frames_is_negative(make_method, tmp_path) -> None:
    def halved(result: dict) -> None:
        for metrics in result["metrics"].values():
            for metric in metrics.values():
                metric["worst5"] *= 0.5
                metric["mean"] *= 3

    for seed in range(3):
        make_method("active_exploration", seed=seed, change=halved)
        make_method("uniform", seed=seed)
    effects = compare(tmp_path).effects
    assert effects["hard_mape_worst5"].effect_percent == pytest.approx(-50)
    assert effects["uniform_dssim_worst5"].effect_percent == pytest.approx(-50)


def test_effect_is_the_ratio_of_errors_on_the_same_frames(make_method, tmp_path) -> None:
    ratios = []
    for seed in range(3):
        folders = [
            make_method("active_exploration", seed=seed, error=0.08),
            make_method("uniform", seed=seed, error=0.1),
        ]
        frames = [json.loads((f / "result.json").read_text())["frames"] for f in folders]
        for better, worse in zip(*frames, strict=True):
            if better["set"] == "hard":
                ratios.append([better[metric] / worse[metric] for metric in METRICS])
    result = compare(tmp_path)
    geometric = np.exp(np.log(ratios).mean(axis=0))
    for metric, ratio in zip(METRICS, geometric, strict=True):
        effect = result.effects[f"hard_{metric}"]
        assert effect.effect_percent == pytest.approx(100 * (ratio - 1))
        assert (effect.seeds, effect.frames) == (3, 5)
        assert result.effects[f"hard_{metric}_worst5"].frames == 0
    assert result.decisive.effect_percent == pytest.approx(
        100 * (np.exp(np.log(ratios).mean()) - 1)
    )
    assert result.decisive.low < -20 < result.decisive.high < -15
    assert result.verdict is Verdict.REPRODUCED
    assert result.seeds_needed is None
    assert set(result.effects) == {
        f"{s}_{m}{suffix}"
        for s in ("hard", "uniform")
        for m in METRICS
        for suffix in ("", "_worst5")
    }


def test_both_seeds_and_frames_are_drawn_by_chance() -> None:
    spread = np.array([-0.3, -0.1, 0.0, 0.1, 0.3])
    by_seed = paired_effect(np.tile(spread[:, None], 5) - 0.2)
    by_frame = paired_effect(np.tile(spread, (5, 1)) - 0.2)
    assert (by_seed.low, by_seed.high) == pytest.approx((by_frame.low, by_frame.high))
    assert by_seed.high - by_seed.low > 20


def test_the_other_way_round_is_not_reproduced(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, error=0.1)
        make_method("uniform", seed=seed, error=0.08)
    result = compare(tmp_path)
    assert result.verdict is Verdict.NOT_REPRODUCED
    assert result.decisive.hedges_g > 0


def test_no_difference_needs_a_narrow_interval(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, spread=0.002)
        make_method("uniform", seed=seed, spread=0.002)
        make_method("active_exploration", scene="bathroom", seed=seed, spread=0.3)
        make_method("uniform", scene="bathroom", seed=seed, spread=0.3)
    assert compare(tmp_path).verdict is Verdict.NOT_REPRODUCED
    unclear = compare(tmp_path, "bathroom")
    assert unclear.verdict is Verdict.INCONCLUSIVE
    assert 3 < unclear.seeds_needed <= MORE_THAN_MOST_SEEDS


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (-5.0, -0.1, Verdict.REPRODUCED),
        (0.1, 5.0, Verdict.NOT_REPRODUCED),
        (-1.9, 1.9, Verdict.NOT_REPRODUCED),
        (-1.5, -0.5, Verdict.NOT_REPRODUCED),
        (-2.5, -0.5, Verdict.REPRODUCED),
        (-2.1, 1.9, Verdict.INCONCLUSIVE),
        (-1.9, 2.1, Verdict.INCONCLUSIVE),
        (None, None, Verdict.INCONCLUSIVE),
    ],
)
def test_verdict_is_read_from_the_interval(low, high, verdict) -> None:
    assert decide(low, high, equivalence=2.0) is verdict


def test_a_claim_stands_with_all_of_its_evidence() -> None:
    yes, no, unclear = Verdict.REPRODUCED, Verdict.NOT_REPRODUCED, Verdict.INCONCLUSIVE
    assert of_tests(yes, [yes]) is yes
    assert of_tests(yes, []) is yes
    assert of_tests(yes, [unclear]) is unclear
    assert of_tests(yes, [no, yes]) is unclear  # one of several would refute by chance
    assert of_tests(no, [yes]) is no
    assert of_tests(unclear, [yes, no]) is unclear


def test_one_seed_has_an_effect_and_no_interval(make_method, tmp_path) -> None:
    make_method("active_exploration", error=0.05)
    make_method("uniform")
    result = compare(tmp_path)
    assert result.decisive.effect_percent == pytest.approx(-50, abs=3)
    assert (result.decisive.low, result.decisive.hedges_g) == (None, None)
    assert (result.verdict, result.seeds_needed) == (Verdict.INCONCLUSIVE, None)


def test_seeds_of_one_method_alone_are_left_out(make_method, tmp_path) -> None:
    for seed in (0, 1):
        make_method("active_exploration", seed=seed)
    assert compare(tmp_path) is None
    for seed in (1, 2):
        make_method("uniform", seed=seed)
    pairs = pair_runs(runs_below(tmp_path), "living-room", "active_exploration", "uniform")
    assert [(pair.better.seed, pair.worse.seed) for pair in pairs] == [(1, 1)]


def test_only_runs_made_in_the_same_way_are_paired(make_method, tmp_path) -> None:
    make_method("active_exploration", overrides="method=active_exploration", error=0.05)
    make_method("active_exploration", overrides="loss.l1_weight=2,method=active_exploration")
    assert compare(tmp_path) is None
    make_method("uniform", overrides="loss.l1_weight=2,method=uniform")
    assert compare(tmp_path).decisive.effect_percent == pytest.approx(0, abs=5)
    make_method("uniform", overrides="method=uniform")
    assert compare(tmp_path).decisive.effect_percent == pytest.approx(-50, abs=5)
    for method in ("active_exploration", "uniform"):  # of most seeds
        make_method(method, overrides=f"loss.l1_weight=2,method={method}", seed=1)
    assert compare(tmp_path).decisive.effect_percent == pytest.approx(0, abs=5)


def spoil(frame: int, value: float):  # type: ignore[no-untyped-def]
    def change(result: dict) -> None:
        result["frames"][frame]["mae"] = value

    return change


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_errors_that_are_not_finite_are_not_dropped(make_method, tmp_path, bad) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, change=spoil(0, bad), error=0.05)
        make_method("uniform", seed=seed)
    result = compare(tmp_path)
    assert math.isnan(result.effects["hard_mae"].effect_percent)
    assert result.effects["hard_mape"].effect_percent == pytest.approx(-50, abs=3)
    assert math.isnan(result.decisive.effect_percent)
    assert (result.verdict, result.seeds_needed) == (Verdict.INCONCLUSIVE, None)


def test_an_error_of_zero_counts_as_a_very_small_one(make_method, tmp_path) -> None:
    make_method("active_exploration", change=spoil(0, 0.0), spread=0)
    make_method("uniform", change=spoil(0, 1e-6), spread=0)
    assert compare(tmp_path).effects["hard_mae"].effect_percent == pytest.approx(0)


def test_without_lpips_the_other_metrics_decide(make_method, tmp_path) -> None:
    def no_lpips(result: dict) -> None:
        for frame in result["frames"]:
            frame["lpips"] = None

    make_method("active_exploration", change=no_lpips)
    make_method("uniform")
    result = compare(tmp_path)
    assert "hard_lpips" not in result.effects
    assert math.isfinite(result.decisive.effect_percent)


def test_scenes_are_pooled_as_draws(make_method, tmp_path) -> None:
    scenes = {"living-room": 0.07, "bathroom": 0.08, "bedroom": 0.09, "chess": 0.11}
    for scene, error in scenes.items():
        for seed in range(3):
            make_method("active_exploration", scene=scene, seed=seed, error=error, spread=1e-6)
            make_method("uniform", scene=scene, seed=seed, spread=1e-6)
    results = [compare(tmp_path, scene) for scene in scenes]
    pooled = pool(results)
    expected = np.exp(np.log([0.7, 0.8, 0.9, 1.1]).mean())
    assert pooled.scene == ALL_SCENES
    assert pooled.decisive.effect_percent == pytest.approx(100 * (expected - 1), abs=1e-3)
    assert pooled.verdict is Verdict.INCONCLUSIVE
    # Two scenes that agree are conclusive about themselves, though not about others.
    agreeing = pool(results[:2])
    assert agreeing.decisive.high > 0
    assert agreeing.verdict is Verdict.REPRODUCED


def test_scenes_of_one_seed_each_decide_nothing_together(make_method, tmp_path) -> None:
    scenes = ("living-room", "bathroom", "bedroom", "chess")
    for scene in scenes:
        make_method("active_exploration", scene=scene, error=0.05)
        make_method("uniform", scene=scene)
    pooled = pool([compare(tmp_path, scene) for scene in scenes])
    assert pooled.decisive.effect_percent < -40
    assert (pooled.decisive.low, pooled.decisive.high) == (None, None)
    assert pooled.verdict is Verdict.INCONCLUSIVE


def test_runs_of_two_experiments_are_not_paired(make_method, tmp_path) -> None:
    make_method("active_exploration", error=0.05)
    make_method("uniform", experiment="other")
    assert pair_runs(find_runs(tmp_path)[0], "living-room", "active_exploration", "uniform") == []


@pytest.mark.usefixtures("undrawn")
def test_ways_that_claims_leave_out_are_said(make_method, tmp_path, capsys) -> None:
    for method in ("active_exploration", "uniform"):
        make_method(method)
        make_method(method, overrides="loss.l1_weight=2")
    assert main([str(tmp_path)]) == 0
    told = "living-room: uniform was run in 2 ways"
    assert told in capsys.readouterr().err
    assert told in (tmp_path / "report" / "results.md").read_text()
