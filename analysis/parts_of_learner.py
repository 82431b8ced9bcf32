"""What each part of ours is worth: tables and a picture of `sweeps/learner`.

`python -m analysis.parts_of_learner FOLDER PICTURE.png` draws the errors over run time of the
sweep's runs in the folder; `analysis.learner_table` writes the tables.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.plots import (
    COLOURS,
    DASHES,
    STYLE,
    add_legend,
    figure_bytes,
    make_logarithmic,
    new_figure,
)
from analysis.readme_table import markdown_row
from analysis.runs import METRICS, Run, find_runs
from analysis.speedup import log_error_series

ABLATIONS = {  # of a whole method: prefix of its runs, caption
    "ours": ("ours_without", "taken out of ours"),
    "active_exploration": ("paper_with", "added to the paper's method"),
}

OTHER_NAMES = {"ours_uniform": "ours_without/sobol_sequence"}
"""Methods that leave a part out and are not named after it."""

NAMED = 4
"""Parts of each ablation that have a colour in the picture, those of the largest effect."""


def errors_by_part(results: pd.DataFrame, whole: str) -> pd.DataFrame:
    """[parts, scenes] errors, the first row those of the whole method, named ''.

    Geometric means of the four metrics on hard frames; NaN where a run is missing. Parts are
    ordered by their effect over all scenes, those that lower the error most by being there first.

    results: the report's table of results on `sweeps/learner`; scenes without the whole method, or
    without any part of it, are left out
    """
    prefix, _ = ABLATIONS[whole]
    error = np.exp(np.log(results[[f"hard_{metric}" for metric in METRICS]]).mean(axis=1))
    methods = results["method"].replace(OTHER_NAMES)
    parts = methods.str.removeprefix(f"{prefix}/").mask(methods == whole, "")
    named = methods.eq(whole) | methods.str.startswith(f"{prefix}/")
    table = pd.DataFrame({"scene": results["scene"], "part": parts, "error": error})[named]
    table = table.pivot(index="part", columns="scene", values="error")
    if "" not in table.index:
        return table.iloc[:0]
    table = table.loc[:, table.loc[""].notna() & table.drop(index="").notna().any()]
    gains = over_all_scenes(table).drop(index="")
    return table.loc[["", *gains.sort_values(ascending=prefix == "paper_with").index]]


def over_all_scenes(errors: pd.DataFrame) -> pd.Series:
    """[parts] relative difference to the whole method, the geometric mean over the scenes."""
    result: pd.Series = np.exp(np.log(errors / errors.loc[""]).mean(axis=1)) - 1
    return result


def parts_table(results: pd.DataFrame) -> str:
    """Two tables, a row per part, a column per scene: errors and their differences to the whole.

    results: the report's table of results on `sweeps/learner`, see `errors_by_part`
    """
    return "\n\n".join(_table(errors_by_part(results, whole), whole) for whole in ABLATIONS)


def _table(errors: pd.DataFrame, whole: str) -> str:
    heads = [ABLATIONS[whole][1], *errors.columns, "all of them"]
    lines = [markdown_row(heads), markdown_row([":--", *["--:"] * (len(heads) - 1)])]
    overall = over_all_scenes(errors) if len(errors) else pd.Series(dtype=float)
    for part in errors.index:
        row = errors.loc[part]
        if part == "":
            cells = [f"**{error:.4f}**" for error in row]
            lines.append(markdown_row(["*nothing*", *cells, ""]))
            continue
        shares = row / errors.loc[""] - 1
        cells = [
            "" if np.isnan(error) else f"{error:.4f} ({share:+.0%})"
            for error, share in zip(row, shares, strict=True)
        ]
        lines.append(markdown_row([_title(part), *cells, f"{overall[part]:+.0%}"]))
    return "\n".join(lines)


def draw(runs: Sequence[Run]) -> bytes:
    """PNG: a row per ablation, a column per scene, error on hard frames against run time.

    runs: of `sweeps/learner`, one seed. Raises ValueError where a whole method is missing.
    """
    methods = [OTHER_NAMES.get(run.label["method"], run.label["method"]) for run in runs]
    by_name = {(run.scene, name): run for run, name in zip(runs, methods, strict=True)}
    ends = [{"scene": scene, "method": name, **_errors(r)} for (scene, name), r in by_name.items()]
    tables = {whole: errors_by_part(pd.DataFrame(ends), whole) for whole in ABLATIONS}
    if missing := [whole for whole, table in tables.items() if table.empty]:
        raise ValueError(f"no runs of {', '.join(missing)} with its parts: run sweeps/learner")
    styles = _styles(tables.values())
    columns = max(len(table.columns) for table in tables.values())
    with matplotlib.rc_context(STYLE):
        figure = new_figure(2.3 * columns + 0.5, 5.6)
        panels = figure.subplots(len(tables), columns, squeeze=False)
        for row, (whole, table) in zip(panels, tables.items(), strict=True):
            prefix, caption = ABLATIONS[whole]
            row[0].set_ylabel(f"error, parts {caption}")
            for axes, scene in zip(row, table.columns, strict=False):
                names = {part: f"{prefix}/{part}" if part else whole for part in table.index[::-1]}
                found = {part: by_name.get((scene, name)) for part, name in names.items()}
                _panel(axes, {part: run for part, run in found.items() if run}, styles)
                axes.set_title(scene)
        add_legend(figure)
        for axes in panels[-1]:
            axes.set_xlabel("run time in seconds")
        return figure_bytes(figure, "png")


def _styles(tables: Iterable[pd.DataFrame]) -> dict[str, dict[str, Any]]:
    """Of the parts that have a colour, and of the whole method, ''."""
    effects = [over_all_scenes(table).drop(index="").abs() for table in tables]
    named = dict.fromkeys(part for effect in effects for part in effect.nlargest(NAMED).index)
    styles: dict[str, dict[str, Any]] = {"": {"color": "black", "linewidth": 2.2}}
    for index, part in enumerate(named):
        colours = COLOURS[:-1]  # the last is black
        dashes = DASHES[index // len(colours) % len(DASHES)]
        styles[part] = {"color": colours[index % len(colours)], "linestyle": dashes}
    return styles


def _panel(axes: Axes, runs: Mapping[str, Run], styles: Mapping[str, dict[str, Any]]) -> None:
    values = []
    for part, run in runs.items():
        seconds, logarithms = log_error_series([run])[0].T
        values.append(np.exp(logarithms))
        style = {"label": _title(part), **styles[part]} if part in styles else {"color": "#c4c4c4"}
        axes.plot(seconds, values[-1], **{"marker": ".", "linewidth": 1.2, **style})
    make_logarithmic(axes, "y", np.concatenate(values))


def _title(part: str) -> str:
    return part.replace("_", " ") or "nothing"


def _errors(run: Run) -> dict[str, float]:
    return {f"hard_{metric}": run.history[f"hard_{metric}"].iloc[-1] for metric in METRICS}


def main() -> int:
    """Entry point; returns the exit status."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        Path(sys.argv[2]).write_bytes(draw(find_runs(Path(sys.argv[1]))[0]))
    except (OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
