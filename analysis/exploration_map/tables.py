"""The map as numbers: every speed-up, and what scoring may cost."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import asdict
from itertools import product
from typing import Any

import pandas as pd

from analysis.exploration_map.heat_maps import REUSE, cell_text
from analysis.exploration_map.runs import BASE, COST_RATIOS, ERRORS, SETTING, samplers_of
from analysis.exploration_map.speedup import Comparison
from analysis.tables import Cell, Table


def speedups(table: pd.DataFrame) -> pd.DataFrame:
    """A row per setting, error, cost ratio, kind of reuse and sampler.

    Columns: the knobs, these, and the fields of `analysis.exploration_map.speedup.Speedup`; at
    the base's cost ratio also break_even_scoring.
    """
    rows = []
    for setting, of_setting in table.groupby(SETTING, sort=False):
        knobs = knobs_of(setting)
        for error, cost_ratio, reuse, sampler in product(
            ERRORS, COST_RATIOS, REUSE, samplers_of(table)
        ):
            comparison = Comparison(of_setting, sampler, reuse, cost_ratio, error)
            row = {
                **knobs, "error": error, "cost_ratio": cost_ratio, "reuse": reuse,
                "sampler": sampler, **asdict(comparison.speedup()),
            }  # fmt: skip
            if cost_ratio == BASE["cost_ratio"]:
                row["break_even_scoring"] = comparison.break_even_scoring()
            rows.append(row)
    return pd.DataFrame(rows)


def speedup_table(speedups: pd.DataFrame, *, error: str, reuse: bool) -> Table:
    """Ratios of run times at the base's cost ratio, a row per setting."""
    title = f"Run time of uniform sampling / of exploration to the same {ERRORS[error]}"
    return _table(f"{title}, {REUSE[reuse]}", speedups, error, reuse, cell_text)


def break_even_table(speedups: pd.DataFrame, *, error: str, reuse: bool) -> Table:
    """What scoring a batch may cost, in training steps; 0: exploration loses even for nothing."""
    title = f"Scoring at which both take as long to the same {ERRORS[error]}, in training steps"
    return _table(
        f"{title}, {REUSE[reuse]}",
        speedups,
        error,
        reuse,
        lambda row: f"{row['break_even_scoring']:.1f}",
    )


def _table(
    title: str,
    speedups: pd.DataFrame,
    error: str,
    reuse: bool,
    text: Callable[[Mapping[Hashable, Any]], str],
) -> Table:
    shown = speedups[
        (speedups["error"] == error)
        & (speedups["reuse"] == reuse)
        & (speedups["cost_ratio"] == BASE["cost_ratio"])
    ]
    samplers = samplers_of(shown)
    rows = []
    for setting, of_setting in shown.groupby(SETTING, sort=False):
        by_sampler = {row["sampler"]: row for row in of_setting.to_dict("records")}
        name = setting_name(knobs_of(setting))
        rows.append((Cell(name), *(Cell(text(by_sampler[sampler])) for sampler in samplers)))
    return Table(title, ("setting", *samplers.values()), tuple(rows), 1)


def knobs_of(setting: Any) -> dict[str, float]:
    """The knobs by name, of the values by which a table is grouped by `SETTING`."""
    return {name: float(value) for name, value in zip(SETTING, setting, strict=True)}


def setting_name(knobs: Mapping[str, float]) -> str:
    """The knobs that are not at the base: 'volume 0.001, dimensions 32'."""
    names = [f"{knob} {knobs[knob]:g}" for knob in SETTING if knobs[knob] != BASE[knob]]
    return ", ".join(names).replace("_", " ") or "base"
