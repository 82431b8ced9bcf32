"""What claims are judged by that is no comparison of two methods on one scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from analysis.claims import SALONS, SEVEN_SCENES, methods_with_ours
from analysis.evidence import EQUIVALENCE, Finding, Verdict, decide
from analysis.pairs import (
    log_error,
    log_errors,
    log_ratios,
    pair_runs,
    runs_of_one_way,
    shared_metrics,
)
from analysis.runs import Run
from analysis.speedup import log_error_series
from analysis.statistics import LEVEL, bootstrap_interval
from analysis.target_map import histogram_distances

METHOD = "active_exploration"

Methods = Mapping[str, str]
"""By the paper's method, the one whose runs are looked at in its place."""
PAPERS: Methods = {}
"""The paper's own."""


def benefit_against_dimensions(runs: Sequence[Run], ours: Methods = PAPERS) -> list[Finding]:
    """Slope of the log ratio exploration / uniform on hard frames over log2 of the variables.

    Least squares over the Salons that were run; every Salon's seeds and frames are resampled.
    Inconclusive until all five were run.
    """
    exploration, uniform = (ours.get(name, name) for name in (METHOD, "uniform"))
    dimensions, samples = [], []
    for salon in SALONS:
        if pairs := pair_runs(runs, salon, exploration, uniform):
            both = [run for pair in pairs for run in (pair.better, pair.worse)]
            ratios = log_ratios(pairs, "hard", shared_metrics(both, "hard"))
            dimensions.append(np.log2(int(salon.removeprefix("salon-"))))
            samples.append(ratios)
    if len(dimensions) < 2:
        return []
    centred = np.array(dimensions) - np.mean(dimensions)
    weights = centred / (centred**2).sum()
    text = "change of the error ratio exploration / uniform per doubling of the variables, in %"
    finding = _percent_finding(text, weights, samples, equivalence=EQUIVALENCE)
    complete = len(samples) == len(SALONS)
    return [finding if complete else replace(finding, verdict=Verdict.INCONCLUSIVE)]


def histogram_follows_target(runs: Sequence[Run], ours: Methods = PAPERS) -> list[Finding]:
    """Change of the distance between the samples' histogram and the target map over a run.

    Mean of the last third of the run less that of the first third, per seed; of the chains alone,
    and beyond what uniform sampling shows while the target map changes. NaN, and inconclusive,
    where a distance in one of these thirds is not known.
    """
    methods = [ours.get(name, name) for name in (METHOD, "metropolis", "uniform")]
    *exploring, uniform = methods
    present = {run.label.get("method") for run in runs if run.scene == "mirror"}
    found = runs_of_one_way(runs, "mirror", *(m for m in methods if m in present))
    in_one_way = [
        replace(run, method=method) for method, by_seed in found.items() for run in by_seed.values()
    ]
    distances = histogram_distances(in_one_way)
    if distances.empty:
        return []
    by_run = ["seed", "method"]
    ends = distances.groupby(by_run)["run_seconds"].transform("max")
    early, late = (
        distances[third].groupby(by_run)["distance"].mean(skipna=False)
        for third in (
            distances["run_seconds"] <= ends / 3,
            distances["run_seconds"] > 2 * ends / 3,
        )
    )
    changes = _difference(late, early)
    by_method = {
        method: changes[changes.index.get_level_values("method") == method].droplevel("method")
        for method in methods
    }
    findings = []
    for method in exploring:
        text = f"distance of histogram and target map under {method}, last less first third"
        findings.append(_finding(text, by_method[method]))
        beyond = _difference(by_method[method], by_method[uniform])
        findings.append(_finding(f"{text}, beyond uniform's change", beyond))
    return findings


def error_still_falls(runs: Sequence[Run], ours: Methods = PAPERS) -> list[Finding]:
    """Change of the error (geometric mean of the hard metrics) in the second half of the run.

    NaN, and inconclusive, where a run diverged.
    """
    of_scene = _runs_of(runs, "bedroom", ours.get(METHOD, METHOD))
    changes = []
    for run, series in zip(of_scene, log_error_series(of_scene), strict=True):
        if run.diverged("hard"):
            changes.append(math.nan)
        elif len(series) > 1:
            seconds, errors = series.T
            changes.append(errors[-1] - np.interp(seconds[-1] / 2, seconds, errors))
    if not changes:
        return []
    text = "change of the hard frames' error in the second half of the run, in %"
    return [_percent_finding(text, [1.0], [np.array(changes)[:, None]], equivalence=EQUIVALENCE)]


def many_variables_are_plausible(runs: Sequence[Run], ours: Methods = PAPERS) -> list[Finding]:
    """Chess against the worst of the seven scenes, and against its own first evaluation.

    Which scene is the worst is seen in the same runs: any of them may make the claim true, so that
    the interval is Bonferroni's for as many tests as there are scenes.
    """
    method = ours.get(METHOD, METHOD)
    chess = _runs_of(runs, "chess", method)
    if not chess:
        return []
    findings = []
    perceived = [m for m in ("dssim", "lpips") if m in shared_metrics(chess, "hard")]
    names = " and ".join(metric.upper() for metric in perceived)
    scenes = {
        scene: _log_errors(_runs_of(runs, scene, method), perceived) for scene in SEVEN_SCENES
    }
    known = {  # one that diverged may be the worst, and is as good as not run
        scene: errors
        for scene, errors in scenes.items()
        if errors.size and np.isfinite(errors).all()
    }
    if known:
        worst = max(known, key=lambda scene: float(known[scene].mean()))
        text = f"{names} of chess against the worst of {len(known)} scenes ({worst}), in %"
        samples = [_log_errors(chess, perceived), known[worst]]
        found = _percent_finding(text, [1.0, -1.0], samples, choices=len(known))
        if found.verdict is Verdict.NOT_REPRODUCED and len(known) < len(SEVEN_SCENES):
            found = replace(found, verdict=Verdict.INCONCLUSIVE)  # those missing may be worse
        findings.append(found)
    else:
        text = f"{names} of chess against the worst scene, none of which has finite errors, in %"
        findings.append(Finding(text, math.nan, None, None, Verdict.INCONCLUSIVE))
    gains = np.array(
        [_log_change(run, [f"hard_{metric}" for metric in perceived]) for run in chess]
    )
    text = f"{names} of chess against its first evaluation, in %"
    findings.append(_percent_finding(text, [1.0], [gains[:, None]]))
    return findings


def _runs_of(runs: Sequence[Run], scene: str, method: str) -> list[Run]:
    """A method's, of one way, a run per seed."""
    return list(runs_of_one_way(runs, scene, method).get(method, {}).values())


def _log_errors(runs: Sequence[Run], metrics: Sequence[str]) -> np.ndarray:
    """[runs, hard frames], mean over the metrics; empty without runs or where one lacks any."""
    if not runs or not set(metrics) <= set(shared_metrics(runs, "hard")):
        return np.empty((0, 0))
    return np.array([list(log_errors(run, "hard", metrics).values()) for run in runs])


def _log_change(run: Run, keys: Sequence[str]) -> float:
    """From the first to the last evaluation, mean over the columns of metrics.csv."""
    first, last = run.history[list(keys)].iloc[[0, -1]].to_numpy(dtype=float)
    return float(np.mean([log_error(b) - log_error(a) for a, b in zip(first, last, strict=True)]))


def _difference(one: pd.Series, other: pd.Series) -> pd.Series:
    """Of what both have; NaN where it is not known of one."""
    ours, others = one.align(other, join="inner")
    difference: pd.Series = ours - others
    return difference


def _finding(text: str, values: pd.Series) -> Finding:
    """The mean of a value per seed, claimed to be negative; inconclusive without any, or if NaN."""
    if values.empty:
        return Finding(text, math.nan, None, None, Verdict.INCONCLUSIVE)
    low = high = None
    mean = float(values.to_numpy().mean())
    if len(values) > 1 and math.isfinite(mean):
        low, high = bootstrap_interval(mean, [values.to_numpy()])
    return Finding(text, mean, low, high, decide(low, high))


def _percent_finding(
    text: str,
    weights: Sequence[float] | np.ndarray,
    samples: Sequence[np.ndarray],
    *,
    equivalence: float = 0.0,
    choices: int = 1,
) -> Finding:
    """100 · (exp(weighted sum of the means) - 1), claimed to be negative.

    samples: [seeds, frames] each, independent of each other; no interval where one has one seed.
    choices: out of how many this test was chosen by its data; corrected for as Bonferroni does.
    """
    centre = float(sum(w * values.mean() for w, values in zip(weights, samples, strict=True)))
    low = high = None
    if np.isfinite(centre) and all(len(values) > 1 for values in samples):
        levels = [
            weight * values.mean(axis=axis)
            for weight, values in zip(weights, samples, strict=True)
            for axis in (0, 1)
            if values.shape[1 - axis] > 1
        ]
        confidence = 1 - (1 - LEVEL) / choices
        interval = bootstrap_interval(centre, levels, confidence=confidence)
        low, high = (100 * float(np.expm1(end)) for end in interval)
    value = 100 * float(np.expm1(centre))
    return Finding(text, value, low, high, decide(low, high, equivalence=equivalence))


_FOUND: Mapping[str, Callable[..., list[Finding]]] = {
    "histogram": histogram_follows_target,
    "dimensions": benefit_against_dimensions,
    "specular": error_still_falls,
    "chess": many_variables_are_plausible,
}
"""By the id of a claim of the paper."""

FINDINGS: Mapping[str, Callable[[Sequence[Run]], list[Finding]]] = {
    **_FOUND,
    **{f"ours_{id_}": partial(find, ours=methods_with_ours(id_)) for id_, find in _FOUND.items()},
}
"""By a claim's id, from runs of one budget and with the claim's reuse; every finding decides."""
