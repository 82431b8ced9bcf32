"""Which runs are compared with each other: of one budget, one clock, one way."""

import pandas as pd
import pytest

from analysis import findings
from analysis.claims import SALONS, SEVEN_SCENES
from analysis.evidence import Verdict
from analysis.methods import name_methods
from analysis.pairs import ways_left_out
from analysis.report import main
from analysis.runs import Run, find_runs
from analysis.verdicts import ClaimResult, judge
from tests.analysis.changes import set_value

EXPLORING, UNIFORM = "active_exploration", "uniform"
BY_THE_MODEL = set_value("clock", value="model")


def judged(folder) -> dict[str, ClaimResult]:  # type: ignore[no-untyped-def]
    return {result.claim.id: result for result in judge(name_methods(find_runs(folder)[0]))}


@pytest.fixture
def mapped(monkeypatch) -> list[Run]:
    """The runs whose histograms were asked for."""
    seen: list[Run] = []

    def distances(runs) -> pd.DataFrame:  # type: ignore[no-untyped-def]
        seen.extend(runs)
        return pd.DataFrame()

    monkeypatch.setattr(findings, "histogram_distances", distances)
    return seen


def test_runs_with_reuse_do_not_choose_the_budget_of_a_claim_without(
    make_method, tmp_path, mapped
) -> None:
    for seed in range(3):
        for method, error in ((EXPLORING, 0.05), (UNIFORM, 0.1)):
            mirror = {"scene": "mirror", "seed": seed}
            make_method(method, **mirror, error=error, reuse="never", budget="small")
            make_method(method, **mirror, budget="hour")
            make_method(method, **mirror, budget="small")
    (comparison,) = judged(tmp_path)["histogram"].comparisons
    assert comparison.decisive.seeds == 3
    assert comparison.decisive.effect_percent == pytest.approx(-50, abs=5)
    assert {(run.label["reuse"], run.label["budget"]) for run in mapped} == {("never", "small")}
    assert len(mapped) == 6


def test_runs_that_make_no_pair_do_not_choose_the_budget(make_method, tmp_path) -> None:
    """At an hour the two methods were run in two ways."""
    for seed in range(3):
        for method, error in ((EXPLORING, 0.05), ("no_preconditioning", 0.1)):
            make_method(method, seed=seed, error=error, budget="small")
        make_method(EXPLORING, seed=seed, budget="hour", overrides="loss.l1_weight=2")
        make_method("no_preconditioning", seed=seed, budget="hour")
    (comparison,) = judged(tmp_path)["preconditioning"].comparisons
    assert comparison.decisive.effect_percent == pytest.approx(-50, abs=5)


@pytest.mark.parametrize("with_uniform", [True, False])
def test_chess_is_judged_at_the_budget_of_the_scenes_beside_it(
    make_method, tmp_path, with_uniform
) -> None:
    for budget, error in (("hour", 0.4), ("small", 0.1)):
        for method in (EXPLORING, UNIFORM) if with_uniform else (EXPLORING,):
            for seed in range(2):
                make_method(method, scene="chess", seed=seed, budget=budget, error=error)
    for scene in SEVEN_SCENES:
        for seed in range(2):
            make_method(EXPLORING, scene=scene, seed=seed, budget="small", error=0.2)
    worst, _ = judged(tmp_path)["chess"].findings
    assert "7 scenes" in worst.text
    assert worst.value == pytest.approx(-50, abs=5)


def test_chess_is_judged_where_it_was_run_though_the_scenes_beside_were_not(
    make_method, tmp_path
) -> None:
    make_method(EXPLORING, scene="chess", budget="small")
    for scene in SEVEN_SCENES:
        make_method(EXPLORING, scene=scene, budget="hour")
    result = judged(tmp_path)["chess"]
    assert len(result.findings) == 2
    assert result.verdict is Verdict.INCONCLUSIVE


def test_runs_of_two_clocks_are_not_paired(make_method, tmp_path) -> None:
    """Seconds that were counted with measured costs are none of the machine's."""
    for seed in range(3):
        make_method(EXPLORING, seed=seed, error=0.05, change=BY_THE_MODEL)
        make_method("no_preconditioning", seed=seed)
    assert judged(tmp_path)["preconditioning"].verdict is Verdict.NOT_RUN
    assert ways_left_out(find_runs(tmp_path)[0])[0].startswith(
        "runs with different budgets, seconds, seconds-model-clock: "
    )
    for seed in range(3, 5):
        make_method("no_preconditioning", seed=seed, change=BY_THE_MODEL)
        make_method(EXPLORING, seed=seed, error=0.05, change=BY_THE_MODEL)
    (comparison,) = judged(tmp_path)["preconditioning"].comparisons
    assert comparison.decisive.seeds == 2
    lines = ways_left_out(find_runs(tmp_path)[0])
    assert (
        "no_preconditioning was run in 2 ways (budget=seconds experiment=demo; "
        "budget=seconds-model-clock experiment=demo)" in lines[1]
    )


@pytest.mark.usefixtures("undrawn")
def test_scenes_that_were_run_in_different_ways_are_said(make_method, tmp_path, capsys) -> None:
    for method in (EXPLORING, "metropolis"):
        make_method(method, scene="sphere-caustic")
        make_method(method, scene="living-room", overrides="loss.l1_weight=2")
    told = (
        "acceptance is judged by runs that were made in different ways: budget=seconds "
        "experiment=demo on sphere-caustic; budget=seconds experiment=demo loss.l1_weight=2 on "
        "living-room"
    )
    assert judged(tmp_path)["acceptance"].doubts == (told,)
    assert main([str(tmp_path)]) == 0
    assert told in capsys.readouterr().err
    assert f"Warning: {told}" in (tmp_path / "report" / "results.md").read_text()


def test_what_findings_compare_is_looked_through_for_different_ways(make_method, tmp_path) -> None:
    make_method(EXPLORING, scene="chess")
    make_method(EXPLORING, scene="bedroom", overrides="loss.l1_weight=2")
    for salon in SALONS:
        for method in (EXPLORING, UNIFORM):
            overrides = "loss.l1_weight=2" if salon == SALONS[-1] else "default"
            make_method(method, scene=salon, overrides=overrides)
    results = judged(tmp_path)
    assert (
        results["chess"]
        .doubts[0]
        .endswith("on chess; budget=seconds experiment=demo loss.l1_weight=2 on bedroom")
    )
    assert "loss.l1_weight=2 on salon-25" in results["dimensions"].doubts[0]
    assert results["same_time"].doubts == ()


def test_runs_of_one_way_are_no_doubt(make_method, tmp_path) -> None:
    """Whatever else there is, and whatever ways other claims are judged by."""
    for scene in ("sphere-caustic", "living-room"):
        for method in (EXPLORING, "metropolis"):
            make_method(method, scene=scene)
    make_method("metropolis", seed=1, overrides="loss.l1_weight=2")
    for method in (EXPLORING, UNIFORM):
        make_method(method, scene="mirror", reuse="never", overrides="reuse=never")
    assert [line for result in judged(tmp_path).values() for line in result.doubts] == []
