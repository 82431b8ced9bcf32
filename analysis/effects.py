"""Two methods compared on a scene, and over several scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.evidence import (
    ALL_SCENES,
    EQUIVALENCE,
    MORE_THAN_MOST_SEEDS,
    ComparisonResult,
    Effect,
    Verdict,
    decide,
)
from analysis.pairs import Pair, log_error, log_ratios, pair_runs, shared_metrics
from analysis.runs import SETS, Run
from analysis.speedup import time_ratio, time_ratio_over_scenes
from analysis.statistics import bootstrap_interval, hedges_g, seeds_to_decide


def paired_effect(ratios: np.ndarray) -> Effect:
    """From log ratios [seeds, frames]; both seeds and frames are drawn by chance."""
    seeds, frames = ratios.shape
    mean = float(ratios.mean())
    low = high = None
    if seeds > 1 and math.isfinite(mean):
        levels = [ratios.mean(axis=1), ratios.mean(axis=0)]
        interval = bootstrap_interval(mean, [level for level in levels if len(level) > 1])
        low, high = map(_percent, interval)
    return Effect(_percent(mean), low, high, hedges_g(ratios.mean(axis=1)), seeds, frames)


def _percent(log_ratio: float) -> float:
    return 100 * math.expm1(log_ratio)


def _worst_effect(pairs: Sequence[Pair], set_name: str, metric: str) -> Effect | None:
    """Of the mean over a set's worst 5 %, paired by seed."""
    values = [
        (
            pair.better.metric(set_name, metric, "worst5"),
            pair.worse.metric(set_name, metric, "worst5"),
        )
        for pair in pairs
    ]
    known = [
        (better, worse) for better, worse in values if better is not None and worse is not None
    ]
    if len(known) < len(values):
        return None
    ratios = np.array([[log_error(better) - log_error(worse)] for better, worse in known])
    return replace(paired_effect(ratios), frames=0)


def compare_on_scene(
    runs: Sequence[Run], scene: str, better: str, worse: str
) -> ComparisonResult | None:
    """Everything about two methods on one scene; None where they share no seed."""
    pairs = pair_runs(runs, scene, better, worse)
    return compare_pairs(pairs, scene, better, worse) if pairs else None


def compare_pairs(pairs: Sequence[Pair], scene: str, better: str, worse: str) -> ComparisonResult:
    """The same of pairs of runs of that scene, one at least."""
    both = [run for pair in pairs for run in (pair.better, pair.worse)]
    effects: dict[str, Effect] = {}
    for set_name in SETS:
        for metric in shared_metrics(both, set_name):
            key = f"{set_name}_{metric}"
            effects[key] = paired_effect(log_ratios(pairs, set_name, [metric]))
            if (worst := _worst_effect(pairs, set_name, metric)) is not None:
                effects[f"{key}_worst5"] = worst
    ratios = log_ratios(pairs, "hard", shared_metrics(both, "hard"))
    decisive = paired_effect(ratios)
    verdict = decide(decisive.low, decisive.high, equivalence=EQUIVALENCE)
    seeds_needed = None
    if verdict is Verdict.INCONCLUSIVE and decisive.low is not None:
        seeds_needed = seeds_to_decide(ratios) or MORE_THAN_MOST_SEEDS
    return ComparisonResult(
        scene, better, worse, decisive, effects, verdict, seeds_needed, time_ratio(pairs)
    )


def pool(results: Sequence[ComparisonResult]) -> ComparisonResult:
    """The same comparison over several scenes, each scene one draw.

    The scatter between scenes holds that of seeds and frames within them, so scenes are the only
    level that is resampled. The verdict is the pooled interval's, or the scenes' where they all
    agree: two scenes cannot speak for others, but for themselves.
    """
    first = results[0]
    shared = set.intersection(*(set(result.effects) for result in results))
    decisive = _pooled_effect([result.decisive for result in results])
    verdict = decide(decisive.low, decisive.high, equivalence=EQUIVALENCE)
    if verdict is Verdict.INCONCLUSIVE and len({result.verdict for result in results}) == 1:
        verdict = first.verdict
    needed = [result.seeds_needed for result in results if result.seeds_needed is not None]
    return ComparisonResult(
        scene=ALL_SCENES,
        better=first.better,
        worse=first.worse,
        decisive=decisive,
        effects={
            key: _pooled_effect([result.effects[key] for result in results])
            for key in first.effects
            if key in shared
        },
        verdict=verdict,
        seeds_needed=max(needed, default=None) if verdict is Verdict.INCONCLUSIVE else None,
        time_ratio=time_ratio_over_scenes([result.time_ratio for result in results]),
    )


def _pooled_effect(effects: Sequence[Effect]) -> Effect:
    means = np.log1p(np.array([effect.effect_percent for effect in effects]) / 100)
    pooled = replace(
        paired_effect(means[:, None]),
        seeds=min(effect.seeds for effect in effects),
        frames=min(effect.frames for effect in effects),
    )
    # One seed shows what happened once in each scene, not how it scatters.
    return pooled if pooled.seeds > 1 else replace(pooled, low=None, high=None, hedges_g=None)
