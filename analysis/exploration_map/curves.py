"""Which knob matters: the ratio of run times along one knob at a time; and the error curves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from analysis.exploration_map.heat_maps import REUSE
from analysis.exploration_map.runs import (
    BASE,
    ERRORS,
    KNOBS,
    SAMPLERS,
    UNIFORM,
    at_base,
    samplers_of,
    scoring_cost,
)
from analysis.exploration_map.speedup import Comparison
from analysis.plots import COLOURS, STYLE, add_legend, new_figure, save_figure

COLUMNS = 4


def write_curves(table: pd.DataFrame, speedups: pd.DataFrame, folder: Path) -> list[Path]:
    """Writes `<error>_knobs` and `<error>_curves` as `.png` and `.svg`; returns the paths."""
    written = []
    with matplotlib.rc_context(STYLE):
        for error in ERRORS:
            knobs = _knobs(speedups[speedups["error"] == error])
            knobs.suptitle(
                f"Run time of uniform sampling / of exploration, to the same {ERRORS[error]}; "
                "bars: 95 % interval; [in brackets]: the base",
                fontsize=9,
            )
            written += save_figure(knobs, folder, f"{error}_knobs")
            written += save_figure(_errors(table, error), folder, f"{error}_curves")
    return written


def _styles() -> dict[str, dict[str, Any]]:
    """A colour per target, a dashed line for Metropolis."""
    return {
        UNIFORM: {"color": "#000000"},
        **{
            sampler: {
                "color": COLOURS[index // 2],
                "linestyle": "--" if sampler.endswith("metropolis") else "-",
            }
            for index, sampler in enumerate(SAMPLERS)
        },
    }


def _knobs(speedups: pd.DataFrame) -> Figure:
    """A panel per knob and kind of reuse."""
    lines = -(-len(KNOBS) // COLUMNS)
    figure = new_figure(3.1 * COLUMNS, 2.1 * lines * len(REUSE) + 0.8)
    panels = figure.subplots(lines * len(REUSE), COLUMNS, sharey=True).ravel()
    cells = [(reuse, knob) for reuse in REUSE for knob in KNOBS]
    for axes, (reuse, knob) in zip(panels, cells, strict=True):
        _knob_panel(axes, at_base(speedups[speedups["reuse"] == reuse], {knob}), knob)
        axes.set_title(f"{REUSE[reuse]}", fontsize=8, loc="left")
    for axes in panels[::COLUMNS]:
        axes.set_ylabel("run time, uniform / exploration")
    add_legend(figure)
    return figure


def _knob_panel(axes: Axes, speedups: pd.DataFrame, knob: str) -> None:
    values = sorted(speedups[knob].unique())
    places = {value: place for place, value in enumerate(values)}
    for index, (sampler, name) in enumerate(samplers_of(speedups).items()):
        line = speedups[speedups["sampler"] == sampler].sort_values(knob)
        x = line[knob].map(places) + 0.05 * (index - 2.5)
        below, above = line["speedup"] - line["low"], line["high"] - line["speedup"]
        axes.errorbar(
            x, line["speedup"], np.clip([below, above], 0, None),
            label=name, linewidth=1.2, elinewidth=0.6, marker="o", markersize=2.5,
            **_styles()[sampler],
        )  # fmt: skip
    axes.axhline(1, color="#666666", linewidth=1)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks(list(places.values()), [_tick(value, knob) for value in values])
    axes.set_xlabel(KNOBS[knob])


def _tick(value: float, knob: str) -> str:
    return f"[{value:g}]" if value == BASE[knob] else f"{value:g}"


def _errors(table: pd.DataFrame, error: str) -> Figure:
    """Error against run time: a panel per volume and kind of reuse."""
    shown = at_base(table, {"volume"})
    volumes = sorted(shown["volume"].unique(), reverse=True)
    figure = new_figure(3.1 * len(volumes), 5.0)
    panels = figure.subplots(len(REUSE), len(volumes), squeeze=False, sharey=True)
    for panel_row, reuse in zip(panels, REUSE, strict=True):
        for axes, volume in zip(panel_row, volumes, strict=True):
            _error_panel(axes, shown[shown["volume"] == volume], reuse, error)
            axes.set_title(f"volume {volume:g}, {REUSE[reuse]}", fontsize=8, loc="left")
        panel_row[0].set_ylabel(ERRORS[error])
    panels[-1, len(volumes) // 2].set_xlabel("run time in training steps, mean over seeds")
    add_legend(figure)
    return figure


def _error_panel(axes: Axes, rows: pd.DataFrame, reuse: bool, error: str) -> None:
    styles = _styles()
    for sampler in (UNIFORM, *samplers_of(rows)):
        comparison = Comparison(rows, sampler, reuse, BASE["cost_ratio"], error)
        curves = comparison.curves(sampler, scoring=scoring_cost(sampler))
        axes.plot(
            curves.times.mean(axis=0),
            curves.errors.mean(axis=0),
            label=SAMPLERS.get(sampler, sampler),
            linewidth=1.2,
            **styles[sampler],
        )
    axes.set_ylim(bottom=0)
