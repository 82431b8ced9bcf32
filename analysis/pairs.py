"""Runs of two methods side by side: pairs by seed, and the log ratios of their frames' errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.runs import METRICS, Run

SMALLEST_ERROR = 1e-6
"""Smaller errors count as this one: no reference is so exact, and 0 has no logarithm."""


@dataclass(frozen=True)
class Pair:
    """Two runs of one scene and seed that differ in the method alone."""

    better: Run
    worse: Run

    @property
    def seed(self) -> int:
        return self.better.seed


def pair_runs(runs: Sequence[Run], scene: str, better: str, worse: str) -> list[Pair]:
    """The runs of a scene with these options of the group `method`, paired by seed, in order.

    Where runs of the two methods were made in several ways (other overrides beside the method),
    only the way with the fewest overrides that both have is taken.
    """
    by_way: dict[tuple[str, ...], dict[str, dict[int, Run]]] = {}
    for run in runs:
        method = run.label.get("method")
        if run.scene == scene and method in (better, worse):
            by_way.setdefault(_other_overrides(run), {}).setdefault(method, {})[run.seed] = run
    shared = [way for way, methods in by_way.items() if len(methods) == 2]
    if not shared:
        return []
    methods = by_way[min(shared, key=lambda way: (len(way), way))]
    return pair_by_seed(methods[better], methods[worse])


def pair_by_seed(better: Mapping[int, Run], worse: Mapping[int, Run]) -> list[Pair]:
    """Runs by their seeds, paired where both methods have the seed, in order."""
    return [Pair(better[seed], worse[seed]) for seed in sorted(better.keys() & worse.keys())]


def _other_overrides(run: Run) -> tuple[str, ...]:
    overrides = run.label["overrides"].split(",")
    return tuple(o for o in overrides if o != "default" and not o.startswith("method="))


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
    """Its logarithm, of `SMALLEST_ERROR` where it is smaller, and NaN where it is not finite."""
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
