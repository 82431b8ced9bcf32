"""Figures of what the chains did, and of where they went against their target density."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.chain_trace import read_chain_trace
from analysis.methods import methods_in_order, title
from analysis.plots import LINE_WIDTH, STYLE, add_legend, new_figure, save_figure
from analysis.runs import Run
from analysis.step_log import mean_over_time, read_steps
from analysis.target_map import Window, histogram_distances, windows

MOST_COLUMNS = 6
"""Of evaluations shown in the figure of histograms, evenly chosen."""

BRIGHTEST = 0.995
"""The colour scale of densities ends at this quantile of all cells, and says so by an arrow."""

PANELS = {
    "large_step_acceptance_rate": "large steps accepted",
    "small_step_acceptance_rate": "small steps accepted",
    "reuse_probability": "reuse probability $p_s$",
    "loss_new": "mean loss of new samples",
    "loss_existing": "mean loss of existing samples",
    "store_size": "stored patches",
    "store_mean_age": "mean age of stored patches, in patches",
}
"""Columns of steps.csv and their diagrams' titles."""

PLANE_NAMES = {
    "scene": ("scene variables", ("$v_1$", "$v_2$")),
    "patch": ("patch position", ("x", "y")),
}
"""Name and axes of what two coordinates of a state can span."""

Styles = Mapping[str, dict[str, Any]]


def write_exploration_figures(runs: Sequence[Run], styles: Styles, folder: Path) -> list[Path]:
    """Figures of every scene whose runs left a trace, as PNG and SVG; returns their paths.

    `exploration_<scene>`: acceptance, lifetimes, reuse and store over time. Where the target
    density was mapped also `histogram_<plane>_<scene>`, of the runs of the smallest seed, and
    `distance_<scene>`; the planes are those of `PLANE_NAMES`.
    """
    written: list[Path] = []
    with matplotlib.rc_context(STYLE):
        for scene in sorted({run.scene for run in runs}):
            of_scene = [run for run in runs if run.scene == scene]
            traced = [run for run in of_scene if read_chain_trace(run) is not None]
            if not traced:
                continue
            written += save_figure(_over_time(traced, styles), folder, f"exploration_{scene}")
            mapped = [run for run in traced if windows(run)]
            if mapped:
                for plane in PLANE_NAMES:
                    figure = _histograms(mapped, plane)
                    written += save_figure(figure, folder, f"histogram_{plane}_{scene}")
                written += save_figure(_distances(mapped, styles), folder, f"distance_{scene}")
    return written


def _first_seed(runs: Sequence[Run], method: str) -> Run:
    return min((run for run in runs if run.method == method), key=lambda run: run.seed)


def _over_time(runs: Sequence[Run], styles: Styles) -> Figure:
    figure = new_figure(12.0, 5.2)
    panels = figure.subplots(2, 4).ravel()
    for method in methods_in_order(runs):
        alike = [run for run in runs if run.method == method]
        logs = [read_steps(run) for run in alike]
        for axes, column in zip(panels, PANELS, strict=False):
            seconds, values = mean_over_time(logs, column)
            known = np.isfinite(values).any(axis=0)
            if known.any():
                mean = np.nanmean(values[:, known], axis=0)
                axes.plot(seconds[known], mean, lw=LINE_WIDTH, **styles[method])
        for index, run in enumerate(alike):
            trace = read_chain_trace(run)
            assert trace is not None
            label = title(method) if index == 0 else None
            panels[-1].step(
                *trace.survival(), where="post", lw=LINE_WIDTH, label=label, **styles[method]
            )
    for axes, heading in zip(panels, PANELS.values(), strict=False):
        axes.set_title(heading, fontsize=9, loc="left")
        axes.set_xlabel("run time in seconds")
        axes.set_ylim(bottom=0)
        if not axes.lines:
            axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", va="center")
            axes.set(xticks=[], yticks=[])
    for axes in panels[:3]:
        axes.set_ylim(0, 1.03)
    panels[-1].set_title("states that live longer, every seed", fontsize=9, loc="left")
    # Limits first: where no state lasts, a logarithmic axis has nothing to be fitted to.
    panels[-1].set(ylim=(5e-3, 1.1), xlabel="proposals", xscale="log", yscale="log")
    panels[-1].set_xlim(left=1)
    for axis in (panels[-1].xaxis, panels[-1].yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    add_legend(figure)
    figure.suptitle(f"{runs[0].scene}: what the chains did (mean over seeds)", fontsize=10)
    return figure


def _histograms(runs: Sequence[Run], plane: str) -> Figure:
    """Two rows per method, target density above histogram, each on one colour scale.

    A map that is no density is left blank.
    """
    shown = {
        method: _evenly(windows(_first_seed(runs, method), plane))
        for method in methods_in_order(runs)
    }
    name, (across, up) = PLANE_NAMES[plane]
    columns = max(len(found) for found in shown.values())
    figure = new_figure(1.55 * columns + 1.6, 3.0 * len(shown) + 0.7)
    rows = figure.subplots(2 * len(shown), columns, squeeze=False, sharex=True, sharey=True)
    pictures = {
        method: [(_relative(w.density), _relative(w.counts.sum(axis=0))) for w in found]
        for method, found in shown.items()
    }
    images = {}
    for row, kind in enumerate(("target density", "chains' states")):
        cells = np.array([pair[row] for pairs in pictures.values() for pair in pairs])
        known = cells[np.isfinite(cells)]
        top = np.quantile(known, BRIGHTEST) if known.size else 1.0
        for line, (method, pairs) in zip(rows[row::2], pictures.items(), strict=True):
            images[kind] = _maps(line, [pair[row] for pair in pairs], top=float(top))
            line[0].set_ylabel(f"{title(method)}\n{kind}\n{up}", fontsize=8)
            for axes, window in zip(line, shown[method] if row == 0 else [], strict=False):
                axes.set_title(f"step {window.step:,}", fontsize=8)
    for axes in rows[-1]:
        axes.set_xlabel(across)
        axes.set(xticks=(0, 0.5, 1), yticks=(0, 0.5, 1))
    for kind, image in images.items():
        label = f"{kind}, 1 where all is alike"
        figure.colorbar(image, ax=rows, extend="max", label=label, shrink=0.6)
    figure.suptitle(
        f"{runs[0].scene}: target density over the {name}, and where the chains stood since the "
        "last map",
        fontsize=10,
    )
    return figure


def _maps(line: Sequence[Axes], densities: Sequence[np.ndarray], *, top: float) -> AxesImage:
    """Draws one density beside the other, and returns the last for its colour scale."""
    for axes, density in zip(line, densities, strict=False):
        axes.grid(False)
        image = axes.imshow(
            density.T,  # the first variable goes to the right
            origin="lower",
            extent=(0, 1, 0, 1),
            vmin=0,
            vmax=top,
            cmap="inferno",
            aspect="equal",
        )
    for axes in line[len(densities) :]:
        axes.axis("off")
    return image


def _evenly(found: Sequence[Window]) -> list[Window]:
    count = min(MOST_COLUMNS, len(found))
    return [found[round(i)] for i in np.linspace(0, len(found) - 1, count)]


def _relative(weights: np.ndarray) -> np.ndarray:
    relative: np.ndarray = weights / weights.mean()
    return relative


def _distances(runs: Sequence[Run], styles: Styles) -> Figure:
    figure = new_figure(8.6, 5.6)
    rows = figure.subplots(len(PLANE_NAMES), 2)
    for (left, right), (plane, (name, _)) in zip(rows, PLANE_NAMES.items(), strict=True):
        distances = histogram_distances(runs, plane)
        for method in methods_in_order(runs):
            colour = styles[method]["color"]
            for seed, run in distances[distances["method"] == method].groupby("seed"):
                first = seed == _first_seed(runs, method).seed
                shared: dict[str, Any] = {"lw": LINE_WIDTH, **styles[method]}
                seconds = run["run_seconds"]
                label = title(method) if first and plane == "scene" else None
                left.plot(seconds, run["distance"], marker="o", ms=2.5, label=label, **shared)
                left.plot(seconds, run["floor"], ":", color=colour, alpha=0.6)
                left.plot(seconds, run["uniform_distance"], "--", color=colour, alpha=0.6)
                points = run[["run_seconds", "gain", "gain_error"]].to_numpy().T
                right.errorbar(*points, marker="o", ms=2.5, **shared)
                right.plot(seconds, run["gain_of_target"], ":", color=colour, alpha=0.6)
        left.set_title(f"distance from the target density, {name}", fontsize=9, loc="left")
        right.set_title("target density where they stood, 1: uniform", fontsize=9, loc="left")
        right.axhline(1, color="#666666", linewidth=0.8)
        left.set_ylim(bottom=0)
    for axes in rows[-1]:
        axes.set_xlabel("run time in seconds")
    grey = {"color": "#666666"}
    rows[0, 0].plot([], [], "--", label="as many uniform states", **grey)
    rows[0, 0].plot([], [], ":", label="as many independent states of the target", **grey)
    add_legend(figure)
    figure.suptitle(
        f"{runs[0].scene}: how closely the chains follow their target (Jensen-Shannon distance)",
        fontsize=10,
    )
    return figure
