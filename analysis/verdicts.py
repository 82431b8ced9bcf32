"""Which of the paper's claims the runs reproduce: `judge(runs)`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.claims import CLAIMS, Claim, Comparison
from analysis.effects import compare_on_scene, pool
from analysis.evidence import ComparisonResult, Finding, Verdict, of_tests
from analysis.findings import FINDINGS
from analysis.pairs import (
    ScenesAndMethods,
    runs_of_one_budget,
    runs_of_one_way,
    shared_seeds,
    way_of,
)
from analysis.runs import Run
from analysis.sentences import in_words


@dataclass(frozen=True)
class ClaimResult:
    """A claim, the evidence, and what to make of it.

    comparisons: per scene, then over all scenes where there are several; sentence: the verdict in
    words; doubts: why to doubt it, a line each; for a claim without runs the tuples are empty.
    """

    claim: Claim
    comparisons: tuple[ComparisonResult, ...]
    findings: tuple[Finding, ...]
    verdict: Verdict
    sentence: str
    doubts: tuple[str, ...]


def judge(runs: Sequence[Run]) -> list[ClaimResult]:
    """Every claim of the paper, in the paper's order, with the evidence that these runs give.

    A claim is reproduced where every comparison and finding that decides it is; not reproduced
    where its primary test is not (`Claim.primary`, named beforehand, so that none of several can be
    picked afterwards); else, or where one or one of its scenes is missing, inconclusive.
    Each comparison is decided by one number chosen beforehand: the error ratio on the hard frames
    (the paper's measure), geometric mean over the metrics that all its runs have, so that no
    metric can be picked afterwards. Its 95 % interval over seeds and frames says how
    (`analysis.evidence.decide`).
    """
    return [_judge(claim, runs) for claim in CLAIMS]


def _judge(claim: Claim, runs: Sequence[Run]) -> ClaimResult:
    runs = [run for run in runs if claim.reuse in (None, run.label["reuse"])]
    compared = _compared(claim)
    runs = runs_of_one_budget(runs, compared)
    by_comparison = [_compare(comparison, runs) for comparison in claim.comparisons]
    comparisons = tuple(result for results in by_comparison for result in results)
    findings = tuple(FINDINGS[claim.id](runs)) if claim.id in FINDINGS else ()
    tests = [
        _of_all_scenes(comparison, results)
        for comparison, results in zip(claim.comparisons, by_comparison, strict=True)
        if comparison.decides
    ]
    if claim.id in FINDINGS:
        found = [finding.verdict for finding in findings] or [Verdict.INCONCLUSIVE]
        tests = [*found, *tests] if claim.primary == "finding" else [*tests, *found]
    verdict = of_tests(tests[0], tests[1:]) if comparisons or findings else Verdict.NOT_RUN
    sentence = in_words(claim, verdict, by_comparison, findings)
    doubts = tuple(_different_ways(claim, runs, compared))
    return ClaimResult(claim, comparisons, findings, verdict, sentence, doubts)


def _compared(claim: Claim) -> list[ScenesAndMethods]:
    """What has to be of one budget: what its comparisons compare, and what its finding does."""
    found: list[ScenesAndMethods] = [
        ((s,), (c.better, c.worse)) for c in claim.comparisons for s in c.scenes
    ]
    if not claim.against:
        return found
    first = claim.comparisons[0]
    sets = [first.scenes, *((*first.scenes, scene) for scene in claim.against)]
    return [*found, *((scenes, (first.better,)) for scenes in sets)]


def _different_ways(
    claim: Claim, runs: Sequence[Run], compared: Sequence[ScenesAndMethods]
) -> list[str]:
    """A line where the runs that count were not all made in one way; `runs_of_one_way` sees to it
    for a scene alone.
    """
    scenes: dict[str, dict[str, None]] = {}
    for together, methods in compared:
        if shared_seeds(runs, together, methods):
            for scene in together:
                by_seed = runs_of_one_way(runs, scene, *methods)[methods[0]]
                way = " ".join(way_of(next(iter(by_seed.values()))))
                scenes.setdefault(way, {})[scene] = None
    if len(scenes) < 2:
        return []
    ways = "; ".join(f"{way} on {', '.join(found)}" for way, found in scenes.items())
    return [f"{claim.id} is judged by runs that were made in different ways: {ways}"]


def _of_all_scenes(comparison: Comparison, results: Sequence[ComparisonResult]) -> Verdict:
    """The last result's verdict (over all scenes or the only one), once every scene was run."""
    complete = {result.scene for result in results} >= set(comparison.scenes)
    return results[-1].verdict if complete else Verdict.INCONCLUSIVE


def _compare(comparison: Comparison, runs: Sequence[Run]) -> list[ComparisonResult]:
    """Per scene that was run, and where there are several, over all of them."""
    found = [
        compare_on_scene(runs, scene, comparison.better, comparison.worse)
        for scene in comparison.scenes
    ]
    results = [result for result in found if result is not None]
    if len(results) > 1:
        results.append(pool(results))
    return [replace(result, decides=comparison.decides) for result in results]
