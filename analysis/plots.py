"""Error against run time: a panel per metric, with a band for what the seeds leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, Locator, LogLocator, MaxNLocator, NullLocator

from analysis.curves import Curve, error_curve
from analysis.files import write
from analysis.methods import methods_in_order, title
from analysis.runs import FURTHER, METRICS, SETS, Run
from analysis.tables import TITLES

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's colours, told apart by colour-blind readers too; yellow is too faint here."""

DASHES = (
    *("-", (0, (5, 1.5)), (0, (1, 1.2))),
    *((0, (6, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)), (0, (9, 2, 3, 2))),
)
"""From the eighth method on, colours come again with another line style."""

LOG_RATIO = 4.0
"""From this ratio of largest to smallest value on, ticks stand at 1, 2, 5, 10, …"""

LINE_WIDTH = 1.4
"""Of a method's curve, in points."""

LEGEND_KEY, LEGEND_CHARACTER = 0.55, 0.078
"""Inches that a legend's entry takes: its line, and a character of its label, at the most."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,  # text stays text; publishers refuse Type 3
    "svg.hashsalt": "analysis",
}
"""Settings of matplotlib for every figure of a report."""

FORMATS = {"png": "Creation Time", "svg": "Date", "pdf": "CreationDate"}
"""Formats of a figure, for pages and for LaTeX, each with the metadata that would make its file
differ from one report to the next.
"""


def method_styles(runs: Sequence[Run]) -> dict[str, dict[str, Any]]:
    """Colour and line style per method, the same in every figure of a report."""
    return {
        method: {
            "color": COLOURS[index % len(COLOURS)],
            "linestyle": DASHES[index // len(COLOURS) % len(DASHES)],
        }
        for index, method in enumerate(methods_in_order(runs))
    }


def new_figure(width: float, height: float) -> Figure:
    """A figure of this size in inches that arranges its panels itself and opens no window."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def figure_bytes(figure: Figure, suffix: str) -> bytes:
    """The figure as one of `FORMATS` without its date: the same runs give the same bytes."""
    stream = BytesIO()
    figure.savefig(stream, format=suffix, dpi=160, metadata={FORMATS[suffix]: None})
    return stream.getvalue()


def save_figure(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Writes `<name>.png`, `.svg` and `.pdf` into `folder`, arranged alike; returns their paths."""
    paths = [folder / f"{name}.{suffix}" for suffix in FORMATS]
    for path in paths:
        write(path, figure_bytes(figure, path.suffix[1:]))
        figure.set_layout_engine("none")  # it is arranged now, which takes as long as drawing it
    return paths


@dataclass(frozen=True)
class ErrorPanel:
    """One diagram: a metric on a set of frames, for runs of one scene, a curve per method."""

    title: str
    runs: Sequence[Run]
    set_name: str
    metric: str
    log_time: bool = False


def scene_panels(runs: Sequence[Run], set_name: str, *, log_time: bool = False) -> list[ErrorPanel]:
    """A panel per metric for the runs of one scene, and of what else all have."""
    columns = set.intersection(*(set(run.history) for run in runs))
    further = [each for each in FURTHER if {f"{name}_{each}" for name in SETS} <= columns]
    return [
        ErrorPanel(f"{TITLES[metric]}, {set_name} frames", runs, set_name, metric, log_time)
        for metric in (*METRICS, *further)
    ]


def write_error_curves(
    runs: Sequence[Run], styles: Mapping[str, dict[str, Any]], folder: Path
) -> list[Path]:
    """Writes `error_<scene>.png` and `.svg` for the runs of one scene and returns their paths."""
    scene = runs[0].scene
    with matplotlib.rc_context(STYLE):
        rows = [scene_panels(runs, set_name) for set_name in SETS]
        figure = error_figure(rows, styles)
        figure.suptitle(f"{scene}: error against run time (band: 95 % interval)", fontsize=10)
        return save_figure(figure, folder, f"error_{scene}")


def error_figure(
    rows: Sequence[Sequence[ErrorPanel]],
    styles: Mapping[str, dict[str, Any]],
    *,
    legend: bool = True,
) -> Figure:
    """Panels in rows of equal length under one legend; expects `STYLE` to be in force."""
    columns = len(rows[0])
    figure = new_figure(3.0 * columns, 2.35 * len(rows) + 0.9 * legend)
    axes_grid = figure.subplots(len(rows), columns, squeeze=False)
    for axes_row, panels in zip(axes_grid, rows, strict=True):
        for axes, panel in zip(axes_row, panels, strict=True):
            _draw(axes, panel, styles)
            axes.set_title(panel.title, fontsize=9, loc="left")
    for axes in axes_grid[-1]:
        axes.set_xlabel("run time in seconds")
    if legend:
        add_legend(figure)
    return figure


def add_legend(figure: Figure) -> None:
    """Of all panels, each label once, below them in as many columns as find room."""
    handles = {
        label: handle
        for axes in figure.axes
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    widest = LEGEND_KEY + LEGEND_CHARACTER * max(map(len, handles), default=0)
    columns = max(1, min(len(handles), int(figure.get_figwidth() / widest)))
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=columns, frameon=False
    )


def _draw(axes: Axes, panel: ErrorPanel, styles: Mapping[str, dict[str, Any]]) -> None:
    key = f"{panel.set_name}_{panel.metric}"
    curves: list[Curve] = []
    for method in methods_in_order(panel.runs):
        runs = [run for run in panel.runs if run.method == method]
        curve = error_curve(runs, key, signed=panel.metric == "relmse")
        if curve is None:
            continue
        curves.append(curve)
        seeds = "1 seed" if curve.n == 1 else f"{curve.n} seeds"
        seeds += f", {curve.diverged} diverged" if curve.diverged else ""
        draw_band(axes, curve, label=f"{title(method)} ({seeds})", **styles[method])
    if not curves:
        axes.text(0.5, 0.5, "not measured", transform=axes.transAxes, ha="center", va="center")
        axes.set(xticks=[], yticks=[])
        return
    values = np.concatenate([array for c in curves for array in (c.mean, c.low, c.high)])
    floor = panel.runs[0].metric(panel.set_name, panel.metric, "floor")
    if floor is not None:
        axes.axhline(
            floor, color="#666666", linestyle=(0, (4, 3)), linewidth=1, label="reference noise"
        )
        values = np.append(values, floor)
    means = np.concatenate([curve.mean for curve in curves])
    if (means <= 0).any():  # as relMSE's may be by chance; a logarithmic axis would leave them out
        largest = float(np.abs(means).max())
        axes.set_yscale("symlog", linthresh=means[means > 0].min(initial=largest) or 1.0)
    else:
        make_logarithmic(axes, "y", values)
    if panel.log_time:
        make_logarithmic(axes, "x", np.concatenate([curve.seconds for curve in curves]))


def draw_band(axes: Axes, curve: Curve, *, label: str, color: str, linestyle: Any = "-") -> None:
    """A curve's mean as a line with markers, and its interval as a band.

    What takes no run time, because nothing is trained, is level all along.
    """
    if not curve.seconds.any():
        axes.axhline(curve.mean[0], linewidth=LINE_WIDTH, label=label, color=color, ls=linestyle)
        axes.axhspan(curve.low[0], curve.high[0], color=color, alpha=0.18, linewidth=0)
        return
    axes.plot(
        curve.seconds,
        curve.mean,
        marker="o",
        markersize=2.5,
        linewidth=LINE_WIDTH,
        label=label,
        color=color,
        linestyle=linestyle,
    )
    axes.fill_between(curve.seconds, curve.low, curve.high, color=color, alpha=0.18, linewidth=0)


def make_logarithmic(axes: Axes, direction: Literal["x", "y"], values: np.ndarray) -> None:
    """A logarithmic axis with plain numbers at the ticks; left linear where no value is above 0."""
    positive = values[np.isfinite(values) & (values > 0)]
    if not len(positive):
        return
    axes.set(**{f"{direction}scale": "log"})
    axis = axes.xaxis if direction == "x" else axes.yaxis
    ratio = positive.max() / positive.min()
    locator: Locator = LogLocator(subs=(1.0, 2.0, 5.0) if ratio < 300 else (1.0,))
    axis.set_major_locator(locator if ratio > LOG_RATIO else MaxNLocator(5, steps=[1, 2, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())
