"""Heat maps: where exploration wins and where it loses, over two knobs at a time."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from analysis.exploration_map.runs import ERRORS, KNOBS, at_base, samplers_of
from analysis.plots import STYLE, new_figure, save_figure

PAIRS = (("dimensions", "volume"), ("noise", "volume"), ("cost_ratio", "volume"))
"""Knobs along the columns and the rows of each map."""

REUSE = {False: "every batch new", True: "with reuse"}

LARGEST = 4.0
"""Ratio at which the colours end."""

LEGEND = (
    "above 1 exploration wins; (in brackets): the 95 % interval holds 1; ≥, ≤: only a bound; "
    "blank: not run"
)


def write_heat_maps(speedups: pd.DataFrame, folder: Path) -> list[Path]:
    """Writes `<error>_<columns>_<rows>.png` and `.svg` per pair of knobs; returns the paths."""
    written = []
    with matplotlib.rc_context({**STYLE, "axes.grid": False}):
        for error, (columns, rows) in product(ERRORS, PAIRS):
            shown = at_base(speedups[speedups["error"] == error], {columns, rows})
            figure = _figure(shown, columns, rows)
            title = f"Run time of uniform sampling / of exploration, to the same {ERRORS[error]}"
            figure.suptitle(f"{title}\n{LEGEND}", fontsize=9)
            written += save_figure(figure, folder, f"{error}_{columns}_{rows}")
    return written


def cell_text(cell: Mapping[Hashable, Any]) -> str:
    """'1.8', '≥2.1' where it is a bound, '(0.9)' where the interval holds 1.

    cell: a row of `analysis.exploration_map.tables.speedups`
    """
    ratio = cell["speedup"]
    sign = "" if not cell["bound"] else "≥" if ratio >= 1 else "≤"
    text = f"{sign}{ratio:.2g}" if ratio < 9.95 else f"{sign}{ratio:.0f}"
    return f"({text})" if cell["low"] <= 1 <= cell["high"] else text


def _figure(speedups: pd.DataFrame, columns: str, rows: str) -> Figure:
    samplers = samplers_of(speedups)
    cells = speedups[columns].nunique(), speedups[rows].nunique()
    figure = new_figure(0.55 * cells[0] * len(samplers) + 2.2, 0.42 * cells[1] * len(REUSE) + 2.2)
    panels = figure.subplots(len(REUSE), len(samplers), squeeze=False, sharex=True, sharey=True)
    for panel_row, (reuse, reuse_name) in zip(panels, REUSE.items(), strict=True):
        for axes, (sampler, name) in zip(panel_row, samplers.items(), strict=True):
            of_method = speedups[(speedups["sampler"] == sampler) & (speedups["reuse"] == reuse)]
            image = _panel(axes, of_method, columns, rows)
            axes.set_title(name.replace(", ", ",\n") if reuse is False else "", fontsize=7)
        panel_row[0].set_ylabel(f"{reuse_name}\n{KNOBS[rows]}")
    figure.supxlabel(KNOBS[columns], fontsize=9)
    bar = figure.colorbar(image, ax=panels, shrink=0.8, pad=0.01)
    ticks = [1 / LARGEST, 0.5, 1.0, 2.0, LARGEST]
    bar.set_ticks([np.log2(tick) for tick in ticks], labels=[f"{tick:g}" for tick in ticks])
    return figure


def _panel(axes: Axes, speedups: pd.DataFrame, columns: str, rows: str) -> AxesImage:
    ratios = speedups.pivot(index=rows, columns=columns, values="speedup")
    limit = np.log2(LARGEST)
    image = axes.imshow(
        np.log2(ratios.to_numpy()), cmap="RdBu", vmin=-limit, vmax=limit, aspect="auto"
    )
    axes.set_xticks(range(ratios.shape[1]), [f"{value:g}" for value in ratios.columns])
    axes.set_yticks(range(ratios.shape[0]), [f"{value:g}" for value in ratios.index])
    axes.tick_params(length=0)
    for cell in speedups.to_dict("records"):  # settings that were not run stay empty
        x, y = list(ratios.columns).index(cell[columns]), list(ratios.index).index(cell[rows])
        dark = abs(np.log2(cell["speedup"])) > 0.65 * limit
        axes.text(
            x, y, cell_text(cell), ha="center", va="center", fontsize=7,
            color="w" if dark else "k",
        )  # fmt: skip
    return image
