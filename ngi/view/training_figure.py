"""A run in one picture while it trains: errors, losses and reuse, chains, the hardest patches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.ticker import FuncFormatter, LogLocator
from torch import Tensor

from ngi.evaluate import METRICS, tone_map
from ngi.evaluate.pictures import eight_bit
from ngi.view.screen import Pixels

COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
WIDTH, HEIGHT, DOTS_PER_INCH = 4.2, 12.0, 100
PATCH_COLUMNS = 4
ABOVE_LEGEND = 20.0
"""Points from curves to their title."""


@dataclass(frozen=True)
class Visited:
    """Where chains have been.

    states: [m, D + 2] proposals, scene vector and patch position in [0, 1], oldest first
    densities: [m], their target densities; NaN where nothing was scored
    current: [n, D + 2], where the chains stand
    """

    states: Tensor
    densities: Tensor
    current: Tensor


@dataclass(frozen=True)
class Axis:
    """A component of a state, from its end where negative, and what it is called."""

    name: str
    component: int


def training_figure(
    *,
    evaluations: pd.DataFrame,
    steps: pd.DataFrame,
    visited: Visited,
    across: Axis,
    up: Axis,
    patches: Tensor,
    losses: Sequence[float],
) -> Pixels:
    """[H, W, 3].

    evaluations, steps: rows of metrics.csv and steps.csv
    patches: [k, P, P, 3] log1p radiance of the stored patches of the highest losses
    """
    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS_PER_INCH, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    grid = figure.add_gridspec(4, 1, height_ratios=(1, 1, 1.2, 0.8))
    _errors(figure.add_subplot(grid[0]), evaluations)
    _losses(figure.add_subplot(grid[1]), steps)
    _chains(figure.add_subplot(grid[2]), visited, across, up)
    _patches(figure, grid[3], patches, losses)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _errors(axes: Axes, evaluations: pd.DataFrame) -> None:
    axes.set(xlabel="run time in seconds")
    axes.set_title("error on hard frames", pad=ABOVE_LEGEND)
    shown = False
    for metric, colour in zip(METRICS, COLOURS, strict=True):
        key = f"hard_{metric}"
        if key in evaluations and evaluations[key].notna().any():
            rows = evaluations[["run_seconds", key]].dropna()
            axes.plot(*rows.to_numpy().T, "o-", ms=3, color=colour, label=metric.upper())
            shown = True
    if shown:
        axes.set_yscale("log")
        _legend(axes)


def _losses(axes: Axes, steps: pd.DataFrame) -> None:
    axes.set(xlabel="run time in seconds")
    axes.set_title("loss and reuse", pad=ABOVE_LEGEND)
    every = max(1, len(steps) // 500)
    for key, colour, label in (
        ("loss_new", COLOURS[0], "new samples"),
        ("loss_existing", COLOURS[1], "stored samples"),
        ("reuse_probability", "#888888", "reuse probability"),
    ):
        if key in steps:
            rows = steps[["run_seconds", key]].iloc[::every].dropna()
            axes.plot(*rows.to_numpy().T, color=colour, label=label, lw=1.2)
    axes.set_ylim(bottom=0)  # keeps the top as it is by then
    if axes.lines:
        _legend(axes)


def _legend(axes: Axes) -> None:
    """Between title and curves, on which it would lie elsewhere."""
    axes.legend(
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(METRICS),
        frameon=False,
        fontsize=8,
        columnspacing=1.0,
        borderaxespad=0.2,
    )


def _chains(axes: Axes, visited: Visited, across: Axis, up: Axis) -> None:
    axes.set(title="chains", xlabel=across.name, ylabel=up.name, xlim=(0, 1), ylim=(0, 1))
    columns = [across.component, up.component]
    if len(visited.states):
        horizontal, vertical = visited.states[:, columns].T.numpy()
        positive = visited.densities[visited.densities > 0]
        points = axes.scatter(
            horizontal,
            vertical,
            c=visited.densities.numpy(),
            cmap="viridis",
            norm="log" if len(positive) else None,
            plotnonfinite=True,
            s=9,
        )
        if len(positive):
            label = "target density of proposals"  # below, so that curves above are as wide
            bar = axes.figure.colorbar(points, ax=axes, label=label, orientation="horizontal")
            steps = (1.0, 3.0) if positive.max() < 100 * positive.min() else (1.0,)
            bar.locator = LogLocator(subs=steps, numticks=5)  # there is room for few
            bar.formatter = FuncFormatter(lambda value, _: f"{value:.1g}")
            bar.minorticks_off()
    horizontal, vertical = visited.current[:, columns].T.numpy()
    axes.scatter(horizontal, vertical, s=45, facecolors="none", edgecolors="#D55E00")


def _patches(figure: Figure, place: SubplotSpec, patches: Tensor, losses: Sequence[float]) -> None:
    rows = max(1, -(-len(patches) // PATCH_COLUMNS))
    grid = place.subgridspec(rows, PATCH_COLUMNS)
    for index, (patch, loss) in enumerate(zip(patches, losses, strict=True)):
        axes = figure.add_subplot(grid[divmod(index, PATCH_COLUMNS)])
        axes.imshow(eight_bit(tone_map(torch.expm1(patch.float()))))
        axes.set_title(f"loss {loss:.3g}", fontsize=8)
        axes.set_axis_off()
