"""Runs of two methods side by side: pairs by seed, and the log ratios of their frames' errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.runs import METRICS, Run

SMALLEST_ERROR = 1e-6
"""Smaller errors count as this one: no reference is so exact, and 0 has no logarithm."""


ScenesAndMethods = tuple[tuple[str, ...], tuple[str, ...]]
"""Scenes, and methods, of which the runs of all with all are compared with each other."""


@dataclass(frozen=True)
class Pair:
    """Two runs of one scene and seed that differ in the method alone."""

    better: Run
    worse: Run


def pair_runs(runs: Sequence[Run], scene: str, better: str, worse: str) -> list[Pair]:
    """The runs of a scene with these options of the group `method`, paired by seed, in order.

    Of runs made in several ways only one way counts, see `runs_of_one_way`.
    """
    found = runs_of_one_way(runs, scene, better, worse)
    if not found:
        return []
    return pair_by_seed(found[better], found[worse])


def runs_of_one_way(runs: Sequence[Run], scene: str, *methods: str) -> dict[str, dict[int, Run]]:
    """By method and seed the runs of a scene, all made in one way; {} without one that all share.

    A way is what was chosen beside the method. Runs of two ways are never mixed: what a further
    override does is no difference between methods, and no scatter between seeds. Of the ways that
    all these methods were run in, that counts in which they share most seeds, of several of these
    that with the fewest overrides, then the first in the alphabet; `ways_left_out` says which
    others there are.
    """
    by_way: dict[tuple[str, ...], dict[str, dict[int, Run]]] = {}
    for run in runs:
        method = run.label.get("method")
        if run.scene == scene and method in methods:
            by_way.setdefault(way_of(run), {}).setdefault(method, {})[run.seed] = run
    shared = [way for way, found in by_way.items() if len(found) == len(set(methods))]
    if not shared:
        return {}
    return by_way[min(shared, key=lambda way: (-len(_seeds_of_all(by_way[way])), len(way), way))]


def runs_of_one_budget(runs: Sequence[Run], compared: Sequence[ScenesAndMethods]) -> list[Run]:
    """Those of one budget and clock: what is said of several scenes and methods is of as much
    training.

    Of several budgets that counts in which most of `compared` share a seed, of several of these
    that with most such seeds, then the first in the alphabet.
    """
    by_budget: dict[str, list[Run]] = {}
    for run in sorted(runs, key=_budget):
        by_budget.setdefault(_budget(run), []).append(run)

    def shared(found: Sequence[Run]) -> tuple[int, int]:
        counts = [len(shared_seeds(found, *together)) for together in compared]
        return sum(map(bool, counts)), sum(counts)

    return max(by_budget.values(), key=shared, default=[])


def shared_seeds(runs: Sequence[Run], scenes: Sequence[str], methods: Sequence[str]) -> set[int]:
    """Those with which each scene was run with each method, the methods of a scene in one way."""
    found = [runs_of_one_way(runs, scene, *methods) for scene in scenes]
    return set.intersection(*map(_seeds_of_all, found))


def _seeds_of_all(by_method: Mapping[str, Mapping[int, Run]]) -> set[int]:
    """Seeds that all methods have; none without methods."""
    seeds = [set(by_seed) for by_seed in by_method.values()]
    return set.intersection(*seeds) if seeds else set()


def ways_left_out(runs: Sequence[Run]) -> list[str]:
    """A line for every scene and method that was run in several ways, of which claims use one,
    and one where there are several budgets.
    """
    ways: dict[tuple[str, str], set[tuple[str, ...]]] = {}
    for run in runs:
        if method := run.label.get("method"):
            ways.setdefault((run.scene, method), set()).add(way_of(run))
    budgets = sorted({_budget(run) for run in runs if run.label.get("method")})
    several = (
        f"runs with different budgets, {', '.join(budgets)}: each claim is judged by the runs of "
        "one budget, the one in which most of its scenes have all of its methods"
    )
    return [several] * (len(budgets) > 1) + [
        f"{scene}: {method} was run in {len(found)} ways "
        f"({'; '.join(' '.join(way) for way in sorted(found, key=lambda w: (len(w), w)))}); claims "
        "are judged by runs of one way only, the one in which the methods share most seeds"
        for (scene, method), found in sorted(ways.items())
        if len(found) > 1
    ]


def pair_by_seed(better: Mapping[int, Run], worse: Mapping[int, Run]) -> list[Pair]:
    """Runs by their seeds, paired where both methods have the seed, in order."""
    return [Pair(better[seed], worse[seed]) for seed in sorted(better.keys() & worse.keys())]


def way_of(run: Run) -> tuple[str, ...]:
    """Budget, clock, experiment and overrides of a run, without its method."""
    overrides = [o for o in run.label["overrides"].split(",") if not o.startswith("method=")]
    chosen = [o for o in overrides if o and o != "default"]
    return (f"budget={_budget(run)}", f"experiment={run.label['experiment']}", *chosen)


def _budget(run: Run) -> str:
    """By the name that folders of sweeps have: what another clock counts is another budget."""
    budget = run.label["budget"]
    return budget if run.clock == "wall" else f"{budget}-{run.clock}-clock"


def shared_metrics(runs: Sequence[Run], set_name: str) -> list[str]:
    """The metrics that every frame of every run has a value for: without weights no LPIPS."""
    return [
        metric
        for metric in METRICS
        if all(
            frame[metric] is not None
            for run in runs
            for frame in run.result["frames"]
            if frame["set"] == set_name
        )
    ]


def log_errors(run: Run, set_name: str, metrics: Sequence[str]) -> dict[int, float]:
    """Per frame of a set the mean of the metrics' logarithms; NaN where an error is not finite."""
    return {
        frame["index"]: float(np.mean([log_error(frame[metric]) for metric in metrics]))
        for frame in run.result["frames"]
        if frame["set"] == set_name
    }


def log_error(error: float) -> float:
    """The logarithm of an error, at least that of `SMALLEST_ERROR`. NaN for NaN or Inf."""
    return math.log(max(error, SMALLEST_ERROR)) if math.isfinite(error) else math.nan


def log_ratios(pairs: Sequence[Pair], set_name: str, metrics: Sequence[str]) -> np.ndarray:
    """ln(error of better / error of worse), mean over the metrics, [pairs, frames].

    Raises ValueError where the runs share no frame of the set.
    """
    better = [log_errors(pair.better, set_name, metrics) for pair in pairs]
    worse = [log_errors(pair.worse, set_name, metrics) for pair in pairs]
    frames = sorted(set.intersection(*(set(errors) for errors in better + worse)))
    if not frames:
        raise ValueError(
            f"{pairs[0].better.folder} and {pairs[0].worse.folder}: result.json has no frame of "
            f"the set '{set_name}' that all runs of the comparison have"
        )
    return np.array(
        [[b[frame] - w[frame] for frame in frames] for b, w in zip(better, worse, strict=True)]
    )
