"""Runs of one scene and method, averaged over their seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from analysis.methods import BASELINE, baselines, methods_in_order
from analysis.runs import DISTINCTIONS, FURTHER, METRICS, SETS, Run
from analysis.statistics import Estimate, estimate, paired_difference

REFERENCE_NOISE = "reference noise"
"""Name of the row that says what a perfect prediction would score."""

COSTS = ("steps", "patches_traced", "paths_traced", "run_seconds")
FRAME_COST = "frame_ms"
"""Milliseconds of a test frame: buffers, what else has to be rendered for the network, as the
observations of CNSR, and the network; runs of earlier versions do not know it."""


@dataclass(frozen=True)
class Summary:
    """One row of the results: a scene, a method, and its values averaged over the seeds.

    values: 'hard_mape', 'hard_mape_worst5', …, 'hard_relmse', 'hard_tail', and the costs; None
        where runs have no such value.
    The reference noise is a summary without runs that has the means' keys only.
    """

    scene: str
    method: str
    runs: tuple[Run, ...]
    values: dict[str, Estimate | None]

    @property
    def is_method(self) -> bool:
        return bool(self.runs)

    @property
    def diverged(self) -> int:
        """Runs that ended with errors that are not finite; means over the seeds are not, either."""
        return sum(run.diverged_anywhere for run in self.runs)


def summarise(runs: Sequence[Run]) -> list[Summary]:
    """One summary per scene and method, and per scene one of the reference noise, in order."""
    summaries = []
    for scene in sorted({run.scene for run in runs}):
        of_scene = [run for run in runs if run.scene == scene]
        for method in methods_in_order(of_scene):
            group = tuple(run for run in of_scene if run.method == method)
            summaries.append(Summary(scene, method, group, _values(group)))
        summaries.append(_reference_noise(of_scene))
    return summaries


def _values(runs: Sequence[Run]) -> dict[str, Estimate | None]:
    values: dict[str, Estimate | None] = {}
    for set_name in SETS:
        means = [(metric, "mean", "") for metric in (*METRICS, *FURTHER)]
        for metric, statistic, suffix in means + [(name, "worst5", "_worst5") for name in METRICS]:
            found = [run.metric(set_name, metric, statistic) for run in runs]
            numbers = [value for value in found if value is not None]
            # Runs with and without LPIPS weights are not averaged as if n were the same.
            complete = len(numbers) == len(runs)
            values[f"{set_name}_{metric}{suffix}"] = estimate(numbers) if complete else None
    for cost in COSTS:
        values[cost] = estimate([float(run.result[cost]) for run in runs])
    seconds = [_frame_seconds(run.result) for run in runs if "frame_seconds" in run.result]
    known = len(seconds) == len(runs)
    values[FRAME_COST] = estimate([1e3 * second for second in seconds]) if known else None
    return values


def _frame_seconds(result: dict[str, Any]) -> float:
    """Buffers are rendered for every evaluation; path tracing without a denoiser wants none."""
    plan = result["config"].get("path_tracing")
    unused = ("buffers",) if plan is not None and plan.get("denoiser") is None else ()
    return float(sum(s for part, s in result["frame_seconds"].items() if part not in unused))


def _reference_noise(runs: Sequence[Run]) -> Summary:
    """The floors; they belong to the references, which all runs of a scene share."""
    values: dict[str, Estimate | None] = {}
    for set_name in SETS:
        for metric in METRICS:
            known = [run.metric(set_name, metric, "floor") for run in runs]
            floor = next((value for value in known if value is not None), None)
            values[f"{set_name}_{metric}"] = None if floor is None else estimate([floor])
    return Summary(runs[0].scene, REFERENCE_NOISE, (), values)


@dataclass(frozen=True)
class Comparison:
    """Two methods of one scene, paired by seed.

    differences: per metric (other - baseline) / baseline; None without shared seeds or values.
    """

    scene: str
    baseline: str
    other: str
    differences: dict[str, Estimate | None]


def compare(summaries: Sequence[Summary], *, baseline: str = BASELINE) -> list[Comparison]:
    """Every method of a scene against its baseline: the first of this name, else the first.

    Where that was run with several budgets, each method has the one of its own.
    """
    comparisons = []
    for scene in dict.fromkeys(summary.scene for summary in summaries):
        methods = [summary for summary in summaries if summary.scene == scene and summary.is_method]
        budgets = {summary.method: summary.runs[0].label.get("budget") for summary in methods}
        named = {summary.method: summary for summary in methods}
        compared = (
            _compare(named[first], named[other])
            for other, first in baselines(budgets, baseline=baseline)
        )
        comparisons += [found for found in compared if any(found.differences.values())]
    return comparisons


def _compare(baseline: Summary, other: Summary) -> Comparison:
    differences = {
        f"{set_name}_{metric}": paired_difference(
            _by_seed(baseline.runs, set_name, metric), _by_seed(other.runs, set_name, metric)
        )
        for set_name in SETS
        for metric in METRICS
    }
    return Comparison(baseline.scene, baseline.method, other.method, differences)


def _by_seed(runs: Sequence[Run], set_name: str, metric: str) -> dict[int, float]:
    """Nothing where a run lacks it: with and without LPIPS weights n is not the same."""
    values = {run.seed: run.metric(set_name, metric) for run in runs}
    known = {seed: value for seed, value in values.items() if value is not None}
    return known if len(known) == len(values) else {}


def to_frame(summaries: Sequence[Summary]) -> pd.DataFrame:
    """Every number with its interval, one row per scene and method, for results.csv."""
    rows = []
    for summary in summaries:
        row: dict[str, object] = {
            "scene": summary.scene,
            "method": summary.method,
            "seeds": " ".join(str(run.seed) for run in summary.runs),
        }
        for key, value in summary.values.items():
            row[key] = None if value is None else value.mean
            row[f"{key}_interval"] = None if value is None else value.half_width
        if summary.runs:
            first = summary.runs[0]
            row["diverged"] = summary.diverged
            row |= {field: first.label[field] for field in ("sampler", *DISTINCTIONS)}
            row["protocol"] = first.result["protocol"]["name"]
        rows.append(row)
    return pd.DataFrame(rows)
