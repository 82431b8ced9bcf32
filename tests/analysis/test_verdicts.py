import re
from pathlib import Path

import pytest
import yaml

from analysis.claim_tables import claims_table
from analysis.claims import CLAIMS, SALONS
from analysis.evidence import ALL_SCENES, Verdict
from analysis.findings import FINDINGS
from analysis.methods import TITLES, name_methods
from analysis.pairs import ways_left_out
from analysis.plots import COLOURS, DASHES
from analysis.runs import find_runs
from analysis.verdicts import ClaimResult, judge
from tests.config.command_line import composed

REPOSITORY = Path(__file__).resolve().parents[2]
MAKEFILE = (REPOSITORY / "Makefile").read_text()


def judged(folder: Path) -> dict[str, ClaimResult]:
    return {result.claim.id: result for result in judge(name_methods(find_runs(folder)[0]))}


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda c: c.id)
def test_a_claim_needs_what_its_sweep_runs(claim) -> None:
    parameters = composed(f"+sweeps={claim.id}").hydra.sweeper.params
    scenes = {scene for comparison in claim.comparisons for scene in comparison.scenes}
    methods = {m for comparison in claim.comparisons for m in (comparison.better, comparison.worse)}
    assert scenes == set(parameters["scene"].split(","))
    assert methods <= set(parameters["method"].split(","))
    assert claim.command == f"make report SWEEPS={claim.id}"
    by_default = re.search(r"^SWEEPS := (.*?[^\\])\n", MAKEFILE, flags=re.DOTALL | re.MULTILINE)
    assert claim.id in by_default[1].split()


def test_every_claim_has_a_test_that_decides() -> None:
    """A comparison or a finding, and the primary one is there."""
    for claim in CLAIMS:
        compared = any(comparison.decides for comparison in claim.comparisons)
        found = claim.id in FINDINGS
        assert compared or found, claim.id
        assert found if claim.primary == "finding" else compared, claim.id
    assert {claim.id for claim in CLAIMS} >= FINDINGS.keys()


EXPLORING = "active_exploration"
PAPERS = {
    "same_time": [(EXPLORING, "uniform")],
    "preconditioning": [(EXPLORING, "no_preconditioning")],
    "resolution": [(EXPLORING, "constant_resolution"), ("uniform", "uniform_growing")],
    "target_function": [(EXPLORING, "loss_target")],
    "acceptance": [(EXPLORING, "metropolis")],
    "histogram": [(EXPLORING, "uniform")],
    "dimensions": [],
    "specular": [("traced_specular", EXPLORING)],
    "cnsr": [(EXPLORING, "cnsr")],
    "anf": [(EXPLORING, "anf")],
    "chess": [],
}
"""What the paper says to be better, and than what, by the claim."""


def test_what_the_paper_says_to_be_better_comes_first_and_which_test_is_primary() -> None:
    papers = [claim for claim in CLAIMS if not claim.with_ours]
    decisive = {c.id: [(x.better, x.worse) for x in c.comparisons if x.decides] for c in papers}
    assert decisive == PAPERS
    primary = {claim.id for claim in papers if claim.primary == "finding"}
    assert primary == {"histogram", "dimensions", "chess"}


def test_with_our_learner_no_statement_is_about_the_papers_optimiser() -> None:
    ours = [claim for claim in CLAIMS if claim.with_ours]
    assert len(ours) == len(CLAIMS) / 2
    assert not any("Adam" in claim.statement for claim in ours)


def test_with_our_learner_each_claim_compares_what_takes_the_papers_place() -> None:
    """Better first. Of what is only shown beside a claim two methods have no counterpart."""
    compared = {
        claim.id: [(c.better, c.worse) for c in claim.comparisons if c.decides] for claim in CLAIMS
    }
    assert compared["ours_preconditioning"] == [("ours_paper_network", "ours_no_preconditioning")]
    assert compared["ours_specular"] == [("ours_exploring", "ours_learned_specular")]
    assert compared["ours_cnsr"] == [("ours_exploring", "cnsr")]
    assert compared["ours_resolution"] == [
        ("ours_exploring_growing", "ours_exploring"),
        ("ours_uniform", "ours_uniform_growing"),
    ]
    number = {claim.id: len(claim.comparisons) for claim in CLAIMS}
    papers = {claim.id for claim in CLAIMS if not claim.with_ours}
    without = {claim: number[claim] - number[f"ours_{claim}"] for claim in papers}
    assert {claim: n for claim, n in without.items() if n} == {"same_time": 1, "target_function": 1}
    assert all(len(compared[claim]) == len(compared[f"ours_{claim}"]) for claim in papers)


def test_the_claim_on_anf_is_at_the_samples_that_anf_gets() -> None:
    (claim,) = [claim for claim in CLAIMS if claim.id == "anf"]
    method = yaml.safe_load((REPOSITORY / "conf" / "method" / "anf.yaml").read_text())
    samples = f"{method['renderer']['samples_per_pixel']} samples per pixel"
    assert samples in claim.title
    assert samples in claim.statement
    assert "at the same frame time" not in claim.statement


def test_every_option_of_method_has_a_title() -> None:
    options = {file.stem for file in (REPOSITORY / "conf" / "method").glob("*.yaml")}
    assert options == set(TITLES)


def test_no_two_methods_have_the_same_curve() -> None:
    assert len(COLOURS) * len(DASHES) >= len(TITLES)


def test_claims_without_runs_say_how_to_run_them(make_run, tmp_path) -> None:
    make_run(sampler="mcmc_loss_step")
    results = judged(tmp_path)
    assert list(results) == [claim.id for claim in CLAIMS]
    assert {result.verdict for result in results.values()} == {Verdict.NOT_RUN}
    assert {result.comparisons + result.findings for result in results.values()} == {()}
    assert results["chess"].claim.command in results["chess"].sentence


def test_scenes_are_judged_one_by_one_and_together(make_method, tmp_path) -> None:
    for scene, error in {"sphere-caustic": 0.05, "living-room": 0.06}.items():
        for seed in range(3):
            make_method("active_exploration", scene=scene, seed=seed, error=error)
            make_method("metropolis", scene=scene, seed=seed)
    result = judged(tmp_path)["acceptance"]
    assert [c.scene for c in result.comparisons] == ["sphere-caustic", "living-room", ALL_SCENES]
    assert all(comparison.decides for comparison in result.comparisons)
    assert result.verdict is Verdict.REPRODUCED
    pooled = result.comparisons[-1].decisive
    numbers = f"{-pooled.effect_percent:.1f} % less error (95 % interval {pooled.low:+.1f} to"
    text = f"Active Exploration against Metropolis acceptance on 2 scenes: {numbers}"
    assert text in result.sentence
    assert "less on 2 of them" in result.sentence


def test_each_learner_is_judged_by_its_own_runs(make_method, tmp_path) -> None:
    for seed in range(3):
        for salon in SALONS:
            error = 0.1 * int(salon.split("-")[1]) ** -0.2
            make_method("ours_exploring", scene=salon, seed=seed, error=error)
            make_method("ours_uniform", scene=salon, seed=seed)
        for scene in ("sphere-caustic", "living-room"):
            make_method("ours_exploring", scene=scene, seed=seed, error=0.05)
            make_method("ours_metropolis", scene=scene, seed=seed)
    results = judged(tmp_path)
    verdicts = {name: result.verdict for name, result in results.items()}
    assert verdicts["acceptance"] is verdicts["dimensions"] is Verdict.NOT_RUN
    assert verdicts["ours_acceptance"] is verdicts["ours_dimensions"] is Verdict.REPRODUCED
    assert "ours exploring, with Metropolis acceptance" in results["ours_acceptance"].sentence


def test_a_missing_scene_leaves_the_claim_open(make_method, tmp_path) -> None:
    for scene in ("bedroom", "bathroom"):
        for seed in range(3):
            make_method("active_exploration", scene=scene, seed=seed, error=0.05)
            make_method("uniform", scene=scene, seed=seed)
    result = judged(tmp_path)["same_time"]
    assert result.comparisons[-1].verdict is Verdict.REPRODUCED
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "5 of 7 scenes are not run yet" in result.sentence


def test_scenes_of_two_budgets_are_not_pooled(make_method, tmp_path) -> None:
    for scene, budget in {"sphere-caustic": "small", "living-room": "hour"}.items():
        for seed in range(3):
            make_method("active_exploration", scene=scene, seed=seed, error=0.05, budget=budget)
            make_method("metropolis", scene=scene, seed=seed, budget=budget)
    result = judged(tmp_path)["acceptance"]
    assert [comparison.scene for comparison in result.comparisons] == ["living-room"]
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "1 of 2 scenes are not run yet" in result.sentence


def test_that_budget_counts_which_most_scenes_share(make_method, tmp_path) -> None:
    for seed in range(3):
        for scene in ("sphere-caustic", "living-room"):
            make_method("active_exploration", scene=scene, seed=seed, error=0.05, budget="small")
            make_method("metropolis", scene=scene, seed=seed, budget="small")
        make_method("active_exploration", seed=seed, error=0.2, budget="hour")
        make_method("metropolis", seed=seed, budget="hour")
    result = judged(tmp_path)["acceptance"]
    assert result.verdict is Verdict.REPRODUCED
    assert result.comparisons[1].decisive.effect_percent == pytest.approx(-50, abs=5)
    lines = ways_left_out(find_runs(tmp_path)[0])
    assert lines[0].startswith("runs with different budgets, hour, small: each claim is judged")


def test_of_two_budgets_with_as_many_scenes_that_with_more_seeds_counts(
    make_method, tmp_path
) -> None:
    for budget, seeds, error in (("machine", 1, 0.2), ("small", 3, 0.05)):
        for seed in range(seeds):
            for scene in ("sphere-caustic", "living-room"):
                named = {"scene": scene, "seed": seed, "budget": budget}
                make_method("active_exploration", error=error, **named)
                make_method("metropolis", **named)
    result = judged(tmp_path)["acceptance"]
    assert result.verdict is Verdict.REPRODUCED
    assert result.comparisons[-1].decisive.seeds == 3


def resolution(make_method, growing: float) -> None:  # type: ignore[no-untyped-def]
    errors = {"active_exploration": 0.05, "constant_resolution": 0.07, "uniform": 0.1}
    for method, error in (errors | {"uniform_growing": growing}).items():
        for seed in range(3):
            make_method(method, seed=seed, error=error)


def test_every_part_of_a_claim_has_to_hold(make_method, tmp_path) -> None:
    resolution(make_method, growing=0.08)
    result = judged(tmp_path)["resolution"]
    verdicts = [(c.better, c.worse, c.verdict, c.decides) for c in result.comparisons]
    assert verdicts == [
        ("active_exploration", "constant_resolution", Verdict.REPRODUCED, True),
        ("uniform", "uniform_growing", Verdict.NOT_REPRODUCED, True),
        ("active_exploration", "uniform", Verdict.REPRODUCED, False),
    ]
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "more error" in result.sentence


def test_the_primary_test_alone_refutes(make_method, tmp_path) -> None:
    errors = {"active_exploration": 0.07, "constant_resolution": 0.05, "uniform": 0.1}
    for method, error in (errors | {"uniform_growing": 0.13}).items():
        for seed in range(3):
            make_method(method, seed=seed, error=error)
    result = judged(tmp_path)["resolution"]
    assert [c.verdict for c in result.comparisons[:2]] == [
        Verdict.NOT_REPRODUCED,
        Verdict.REPRODUCED,
    ]
    assert result.verdict is Verdict.NOT_REPRODUCED
    lines = claims_table([result]).rows
    assert [row[1].text for row in lines] == ["primary", "further"]


def test_a_further_test_without_the_primary_one_is_no_primary_one(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("uniform", seed=seed, error=0.1)
        make_method("uniform_growing", seed=seed, error=0.05)
    result = judged(tmp_path)["resolution"]
    (comparison,) = result.comparisons
    assert (comparison.better, comparison.verdict) == ("uniform", Verdict.NOT_REPRODUCED)
    assert result.verdict is Verdict.INCONCLUSIVE
    assert [row[1].text for row in claims_table([result]).rows] == ["further"]


def test_a_claim_of_runs_without_reuse_is_judged_by_these(make_method, tmp_path) -> None:
    for seed in range(3):
        for method, error in (("active_exploration", 0.05), ("uniform", 0.1)):
            make_method(method, scene="mirror", seed=seed, error=error, reuse="never")
            make_method(method, scene="mirror", seed=seed + 3, error=0.1)
    (comparison,) = judged(tmp_path)["histogram"].comparisons
    assert comparison.decisive.seeds == 3
    assert comparison.decisive.effect_percent == pytest.approx(-50, abs=5)


def test_a_claim_with_both_parts(make_method, tmp_path) -> None:
    resolution(make_method, growing=0.13)
    assert judged(tmp_path)["resolution"].verdict is Verdict.REPRODUCED


def test_a_missing_part_leaves_the_claim_open(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, error=0.05)
        make_method("constant_resolution", seed=seed)
    result = judged(tmp_path)["resolution"]
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "no runs yet of uniform sampling and uniform sampling with growing" in result.sentence


def test_what_is_shown_beside_does_not_decide(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, error=0.05)
        make_method("loss_target", seed=seed)
        make_method("output_gradient_target", seed=seed, error=0.2)
    result = judged(tmp_path)["target_function"]
    assert [c.verdict for c in result.comparisons] == [Verdict.REPRODUCED, Verdict.NOT_REPRODUCED]
    assert result.verdict is Verdict.REPRODUCED
    assert "output" not in result.sentence


def test_a_finding_decides_too(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("traced_specular", scene="bedroom", seed=seed, error=0.05)
        make_method("active_exploration", scene="bedroom", seed=seed, rate=0.2)
    result = judged(tmp_path)["specular"]
    assert result.comparisons[0].verdict is Verdict.REPRODUCED
    assert result.findings[0].verdict is Verdict.NOT_REPRODUCED
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "second half of the run" in result.sentence


def test_a_missing_finding_leaves_the_claim_open(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", scene="mirror", seed=seed, error=0.05, reuse="never")
        make_method("uniform", scene="mirror", seed=seed, reuse="never")
    result = judged(tmp_path)["histogram"]
    assert result.comparisons[0].verdict is Verdict.REPRODUCED
    assert (result.findings, result.verdict) == ((), Verdict.INCONCLUSIVE)
    assert "not measured in these runs" in result.sentence


def test_an_open_question_says_how_many_seeds_would_answer_it(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, error=0.11, spread=0.3)
        make_method("no_preconditioning", seed=seed, spread=0.3)
    result = judged(tmp_path)["preconditioning"]
    needed = result.comparisons[0].seeds_needed
    assert result.verdict is Verdict.INCONCLUSIVE
    assert (f"{needed} seeds would" if needed <= 100 else "more than 100 seeds") in result.sentence


def test_no_difference_is_said_so(make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("active_exploration", seed=seed, spread=0.001)
        make_method("no_preconditioning", seed=seed, spread=0.001)
    result = judged(tmp_path)["preconditioning"]
    assert result.verdict is Verdict.NOT_REPRODUCED
    assert "a difference of 2 % or more is excluded" in result.sentence


def test_errors_that_are_not_finite_are_said_so(make_method, tmp_path) -> None:
    def spoil(result: dict) -> None:
        result["frames"][0]["mae"] = float("nan")

    for seed in range(3):
        make_method("active_exploration", seed=seed, change=spoil)
        make_method("no_preconditioning", seed=seed)
    result = judged(tmp_path)["preconditioning"]
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "not finite" in result.sentence


def test_one_seed_decides_nothing(make_method, tmp_path) -> None:
    make_method("active_exploration", error=0.01)
    make_method("no_preconditioning")
    result = judged(tmp_path)["preconditioning"]
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "one seed decides nothing" in result.sentence
