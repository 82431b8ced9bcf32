"""Errors over run time of ours without each of its parts, and of the paper's method with them.

`python -m analysis.parts_plot FOLDER OUTPUT` draws the runs of `sweeps/learner` in a folder,
OUTPUT/parts.png, and writes their errors, OUTPUT/ablation.csv, for `analysis.learner_table`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.command import errors_in_a_line
from analysis.curves import mean_curve
from analysis.files import write
from analysis.parts_of_learner import (
    ABLATIONS,
    OTHER_NAMES,
    effects,
    errors_by_part,
    errors_of,
    title,
)
from analysis.plots import (
    COLOURS,
    DASHES,
    STYLE,
    add_legend,
    figure_bytes,
    make_logarithmic,
    new_figure,
)
from analysis.runs import Run, find_runs
from analysis.speedup import log_error_series

NAMED = 4
"""Parts of each ablation that have a colour in the picture, those of the largest effect."""


def draw(runs: Sequence[Run]) -> bytes:
    """PNG: a row per ablation, a column per scene, error on hard frames against run time.

    runs: of `sweeps/learner`; a curve is the mean over a method's seeds. Raises ValueError where a
    whole method is missing.
    """
    by_name: dict[tuple[str, str], list[Run]] = {}
    for run in runs:
        method = run.label.get("method") or ""
        by_name.setdefault((run.scene, OTHER_NAMES.get(method, method)), []).append(run)
    errors = errors_of(runs)
    tables = {whole: errors_by_part(errors, whole) for whole in ABLATIONS}
    if missing := [whole for whole, table in tables.items() if table.empty]:
        raise ValueError(f"no runs of {', '.join(missing)} with its parts: run sweeps/learner")
    styles = _styles(tables.values())
    scenes = {whole: table.columns.unique("scene") for whole, table in tables.items()}
    columns = max(map(len, scenes.values()))
    with matplotlib.rc_context(STYLE):
        figure = new_figure(2.3 * columns + 0.5, 5.6)
        panels = figure.subplots(len(tables), columns, squeeze=False)
        for row, (whole, table) in zip(panels, tables.items(), strict=True):
            prefix, caption = ABLATIONS[whole]
            row[0].set_ylabel(f"error, parts {caption}")
            for axes, scene in zip(row, scenes[whole], strict=False):
                names = {part: f"{prefix}/{part}" if part else whole for part in table.index[::-1]}
                found = {part: by_name.get((scene, name)) for part, name in names.items()}
                _panel(axes, {part: seeds for part, seeds in found.items() if seeds}, styles)
                axes.set_title(scene)
        add_legend(figure)
        for axes in panels[-1]:
            axes.set_xlabel("run time in seconds")
        return figure_bytes(figure, "png")


def _styles(tables: Iterable[pd.DataFrame]) -> dict[str, dict[str, Any]]:
    """Of the parts that have a colour, and of the whole method, ''."""
    sizes = [effects(table).abs() for table in tables]
    named = dict.fromkeys(part for size in sizes for part in size.nlargest(NAMED).index)
    styles: dict[str, dict[str, Any]] = {"": {"color": "black", "linewidth": 2.2}}
    for index, part in enumerate(named):
        colours = COLOURS[:-1]  # the last is black
        dashes = DASHES[index // len(colours) % len(DASHES)]
        styles[part] = {"color": colours[index % len(colours)], "linestyle": dashes}
    return styles


def _panel(
    axes: Axes, runs: Mapping[str, Sequence[Run]], styles: Mapping[str, dict[str, Any]]
) -> None:
    """Curves of the geometric mean of the metrics that all runs have, on hard frames."""
    values = [np.empty(0)]
    series = iter(log_error_series([run for seeds in runs.values() for run in seeds]))
    for part, seeds in runs.items():
        whole = [errors for errors in islice(series, len(seeds)) if len(errors)]
        curve = mean_curve([np.stack([each[:, 0], np.exp(each[:, 1])], axis=1) for each in whole])
        if curve is None:
            continue
        values.append(curve.mean)
        style = {"label": title(part), **styles[part]} if part in styles else {"color": "#c4c4c4"}
        axes.plot(curve.seconds, curve.mean, **{"marker": ".", "linewidth": 1.2, **style})
    make_logarithmic(axes, "y", np.concatenate(values))


@errors_in_a_line
def main() -> int:
    """Entry point; returns the exit status."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    runs, output = find_runs(Path(sys.argv[1]))[0], Path(sys.argv[2])
    picture = draw(runs)
    output.mkdir(parents=True, exist_ok=True)
    write(output / "parts.png", picture)
    write(output / "ablation.csv", errors_of(runs).to_csv(index=False, float_format="%.6g"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
