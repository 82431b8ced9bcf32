"""What the chains did, beside what came out: acceptance, lifetimes, mixing, and where they went."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analysis.chain_trace import ChainTrace, read_chain_trace
from analysis.effective_sample_size import effective_sample_size
from analysis.methods import methods_in_order, title
from analysis.runs import Run
from analysis.statistics import estimate
from analysis.step_log import read_steps
from analysis.tables import MISSING, Cell, Table, format_estimate

COLUMNS = {
    "acceptance": "accepted",
    "large_step_acceptance": "large steps",
    "small_step_acceptance": "small steps",
    "median_lifetime": "median lifetime",
    "effective_positions": "effective positions",
    "effective_targets": "effective targets",
    "reuse_probability": "reuse probability",
    "store_size": "stored patches",
    "store_mean_age": "their mean age in patches",
}


def exploration_numbers(run: Run) -> dict[str, float] | None:
    """What the chains and the store of one run did; None for a run that left no trace.

    acceptance, and that of large and of small steps: accepted part of the proposals
    median_lifetime: proposals made from a state until half of the states are left
    effective_positions: effective sample size per 1,000 states of a chain, mean over chains and
        components of the position; effective_targets: that of the target density
    reuse_probability, store_size, store_mean_age: mean over the last tenth of the steps; the age
        in patches that were stored since
    NaN stands for what a run does not have: small steps of uniform sampling, say.
    """
    trace = read_chain_trace(run)
    if trace is None:
        return None
    steps = read_steps(run)
    last = steps[steps["step"] > 0.9 * steps["step"].max()]
    return {
        "acceptance": trace.acceptance_rate(),
        "large_step_acceptance": trace.acceptance_rate(large_step=True),
        "small_step_acceptance": trace.acceptance_rate(large_step=False),
        "median_lifetime": trace.median_lifetime(),
        "effective_positions": _effective_per_thousand(trace, trace.state),
        "effective_targets": _effective_per_thousand(trace, trace.state_target),
        **{name: float(last[name].mean()) for name in list(COLUMNS)[-3:]},
    }


def exploration_table(runs: Sequence[Run]) -> Table:
    """`exploration_numbers` of every scene and method, mean and interval over seeds."""
    rows = []
    for scene in sorted({run.scene for run in runs}):
        for method in methods_in_order([run for run in runs if run.scene == scene]):
            alike = [run for run in runs if (run.scene, run.method) == (scene, method)]
            numbers = [found for run in alike if (found := exploration_numbers(run)) is not None]
            if numbers:
                cells = [Cell(_text([found[key] for found in numbers])) for key in COLUMNS]
                names = (Cell(scene), Cell(title(method)), Cell(str(len(numbers))))
                rows.append((*names, *cells))
    heading = (
        "What the chains did: share of proposals accepted, lifetime of a state in proposals, "
        "effective sample size per 1,000 states of a chain, and reuse at the end"
    )
    return Table(heading, ("scene", "method", "n", *COLUMNS.values()), tuple(rows), 2)


def _effective_per_thousand(trace: ChainTrace, series: np.ndarray | None) -> float:
    """Without the first batch, in which the chains start and nothing is compared."""
    if series is None or len(trace.step) < 3:
        return math.nan
    return float(1000 * np.mean(effective_sample_size(series[1:])) / (len(series) - 1))


def _text(values: Sequence[float]) -> str:
    """Of the runs together; a value that is not known of one is not known of them."""
    known = all(math.isfinite(value) for value in values)
    return format_estimate(estimate(list(values))) if known else MISSING
