"""Verdicts in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from analysis.claims import Claim
from analysis.evidence import (
    ALL_SCENES,
    EQUIVALENCE,
    MORE_THAN_MOST_SEEDS,
    ComparisonResult,
    Effect,
    Finding,
    Verdict,
)
from analysis.methods import title


def in_words(
    claim: Claim,
    verdict: Verdict,
    comparisons: Sequence[Sequence[ComparisonResult]],
    findings: Sequence[Finding],
) -> str:
    """What the runs say about a claim; comparisons: one sequence per comparison of the claim.

    Only what decides is put into words, a sentence each, after the verdict itself.
    """
    if verdict is Verdict.NOT_RUN:
        return f"Not run yet; {claim.command} runs it."
    sentences = [f"{verdict.capitalize()}."]
    for comparison, results in zip(claim.comparisons, comparisons, strict=True):
        if not comparison.decides:
            continue
        if results:
            sentences.append(_comparison_in_words(results, len(comparison.scenes)))
        else:
            better, worse = title(comparison.better), title(comparison.worse)
            sentences.append(f"There are no runs yet of {better} and {worse} with the same seeds.")
    sentences += [_finding_in_words(finding) for finding in findings]
    if claim.test and not findings:
        sentences.append("The other deciding quantity was not measured in these runs.")
    return " ".join(sentences)


def _comparison_in_words(results: Sequence[ComparisonResult], claimed: int) -> str:
    decisive = results[-1]
    better, worse = title(decisive.better), title(decisive.worse)
    scenes = [result for result in results if result.scene != ALL_SCENES]
    where = f"on {decisive.scene}" if len(scenes) == 1 else f"on {len(scenes)} scenes"
    text = f"{better} against {worse} {where}: "
    if math.isnan(decisive.decisive.effect_percent):
        return f"{text[0].upper()}{text[1:]}no comparison, since some errors are not finite."
    text += _difference(decisive.decisive)
    if len(scenes) > 1:
        fewer = sum(result.decisive.effect_percent < 0 for result in scenes)
        text += f", less on {fewer} of them"
    text += _consequence(decisive)
    if len(scenes) < claimed:
        text += f"; {claimed - len(scenes)} of {claimed} scenes are not run yet"
    return f"{text[0].upper()}{text[1:]}."


def _difference(effect: Effect) -> str:
    """'12.3 % less error (95 % interval -20.1 to -3.2 %, 3 seeds)'."""
    amount = f"{abs(effect.effect_percent):.1f} % {'less' if effect.effect_percent < 0 else 'more'}"
    seeds = "1 seed" if effect.seeds == 1 else f"{effect.seeds} seeds"
    if effect.low is None or effect.high is None:
        return f"{amount} error (no interval from {seeds})"
    return f"{amount} error (95 % interval {effect.low:+.1f} to {effect.high:+.1f} %, {seeds})"


def _consequence(result: ComparisonResult) -> str:
    effect = result.decisive
    if effect.low is None or effect.high is None:
        return "; one seed decides nothing"
    if effect.low > -EQUIVALENCE and effect.high < EQUIVALENCE:
        return f"; a difference of {EQUIVALENCE:.0f} % or more is excluded"
    if result.seeds_needed is None:
        return ""
    many = result.seeds_needed >= MORE_THAN_MOST_SEEDS
    seeds = "more than 100 seeds" if many else f"{result.seeds_needed} seeds"
    if result.scene == ALL_SCENES:
        return f"; if the measured differences are the true ones, {seeds} would decide every scene"
    return f"; if that is the true difference, {seeds} would show it"


def _finding_in_words(finding: Finding) -> str:
    text = f"{finding.text[0].upper()}{finding.text[1:]}: "
    text += "not measured, or not finite" if math.isnan(finding.value) else f"{finding.value:+.3g}"
    if finding.low is not None and finding.high is not None:
        text += f" (95 % interval {finding.low:+.3g} to {finding.high:+.3g})"
    return f"{text}; {finding.verdict}."
