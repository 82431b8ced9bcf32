"""Error against run time: one figure per scene, a panel per metric and set of frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from analysis.curves import Curve, error_curve
from analysis.methods import methods_in_order
from analysis.runs import METRICS, SETS, Run
from analysis.tables import TITLES

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's colours, told apart by colour-blind readers too; yellow is too faint here."""

DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)))
"""From the eighth method on, colours come again with another line style."""

LOG_RATIO = 4.0
"""The error axis is logarithmic where its largest value is so many times its smallest."""

_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "analysis",
}


def method_styles(runs: Sequence[Run]) -> dict[str, dict[str, Any]]:
    """Colour and line style per method, the same in every figure of a report."""
    return {
        method: {
            "color": COLOURS[index % len(COLOURS)],
            "linestyle": DASHES[index // len(COLOURS) % len(DASHES)],
        }
        for index, method in enumerate(methods_in_order(runs))
    }


def write_error_curves(
    runs: Sequence[Run], styles: Mapping[str, dict[str, Any]], folder: Path
) -> list[Path]:
    """Writes `error_<scene>.png` and `.svg` for every scene and returns their paths."""
    written = []
    for scene in sorted({run.scene for run in runs}):
        of_scene = [run for run in runs if run.scene == scene]
        with matplotlib.rc_context(_STYLE):
            figure = _figure(scene, of_scene, styles)
            for suffix, dated in (("png", "Creation Time"), ("svg", "Date")):
                path = folder / f"error_{scene}.{suffix}"
                # Without its date the same runs give the same file.
                figure.savefig(path, dpi=160, metadata={dated: None})
                written.append(path)
    return written


def _figure(scene: str, runs: Sequence[Run], styles: Mapping[str, dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(3.0 * len(METRICS), 5.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(SETS), len(METRICS), squeeze=False)
    for row, set_name in enumerate(SETS):
        for column, metric in enumerate(METRICS):
            axes = panels[row, column]
            _panel(
                axes,
                runs,
                f"{set_name}_{metric}",
                runs[0].metric(set_name, metric, "floor"),
                styles,
            )
            axes.set_title(f"{TITLES[metric]}, {set_name} frames", fontsize=9, loc="left")
            if row == len(SETS) - 1:
                axes.set_xlabel("run time in seconds")
    handles = {
        label: handle
        for axes in panels.flat
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, frameon=False
    )
    figure.suptitle(f"{scene}: error against run time (band: range of the seeds)", fontsize=10)
    return figure


def _panel(
    axes: Axes,
    runs: Sequence[Run],
    key: str,
    floor: float | None,
    styles: Mapping[str, dict[str, Any]],
) -> None:
    curves: list[Curve] = []
    for method in methods_in_order(runs):
        curve = error_curve([run for run in runs if run.method == method], key)
        if curve is None:
            continue
        curves.append(curve)
        seeds = "1 seed" if curve.n == 1 else f"{curve.n} seeds"
        axes.plot(
            curve.seconds,
            curve.mean,
            marker="o",
            markersize=2.5,
            linewidth=1.4,
            label=f"{method} ({seeds})",
            **styles[method],
        )
        axes.fill_between(
            curve.seconds,
            curve.low,
            curve.high,
            color=styles[method]["color"],
            alpha=0.18,
            linewidth=0,
        )
    if not curves:
        axes.text(0.5, 0.5, "not measured", transform=axes.transAxes, ha="center", va="center")
        axes.set(xticks=[], yticks=[])
        return
    if floor is not None:
        axes.axhline(
            floor, color="#666666", linestyle=(0, (4, 3)), linewidth=1, label="reference noise"
        )
    values = np.concatenate([c.low for c in curves] + [c.high for c in curves])
    _scale_errors(axes, values if floor is None else np.append(values, floor))


def _scale_errors(axes: Axes, values: np.ndarray) -> None:
    """Logarithmic where the values span enough of it; plain numbers at the ticks.

    Time stays linear: evaluations are spread evenly over it.
    """
    if values.min() <= 0 or values.max() < LOG_RATIO * values.min():
        return
    axes.set_yscale("log")
    decades = np.log10(values.max() / values.min())
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.5 else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
