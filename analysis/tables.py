"""Tables as text: for the terminal, Markdown and LaTeX."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tabulate import tabulate

from analysis.methods import title as method_title
from analysis.runs import METRICS, SETS
from analysis.statistics import Estimate
from analysis.summary import COSTS, FRAME_COST, Comparison, Summary

TITLES = {
    "mape": "MAPE",
    "dssim": "DSSIM",
    "mae": "MAE",
    "lpips": "LPIPS",
    "relmse": "noise-free relMSE",
    "tail": "worst 5 % of pixels",
}
COST_TITLES = dict(
    zip(
        (*COSTS, FRAME_COST),
        ("steps", "patches traced", "paths traced", "run seconds", "ms per frame"),
        strict=True,
    )
)
MISSING = "–"


@dataclass(frozen=True)
class Cell:
    text: str
    best: bool = False


@dataclass(frozen=True)
class Table:
    """A title, the columns' names, and rows of cells; the first `labels` columns are text."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    labels: int

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"{self.title}: {len(row)} cells below {len(self.columns)} titles")


def error_table(summaries: Sequence[Summary], sets: Sequence[str] = SETS) -> Table:
    """Mean metrics with intervals and the reference noise; the scene's best mean is marked."""
    title = f"Error on {' and '.join(sets)} frames, mean"
    return _table(title, summaries, _metric_columns(sets), format_estimate)


def worst_table(summaries: Sequence[Summary], sets: Sequence[str] = SETS) -> Table:
    """The metrics' means over the worst 5 % of the frames, with intervals."""
    methods = [summary for summary in summaries if summary.is_method]
    keys = {f"{key}_worst5": column for key, column in _metric_columns(sets).items()}
    title = f"Error on {' and '.join(sets)} frames, mean of the worst 5 %"
    return _table(title, methods, keys, format_estimate)


def cost_table(summaries: Sequence[Summary]) -> Table:
    """What the runs took, and what a test frame takes; means over seeds."""
    methods = [summary for summary in summaries if summary.is_method]
    return _table("Cost", methods, COST_TITLES, lambda value: f"{value.mean:,.0f}", mark_best=False)


def comparison_table(comparisons: Sequence[Comparison], sets: Sequence[str] = SETS) -> Table:
    """For 'first / second': (first - second) / second, negative where first has less error."""
    keys = _metric_columns(sets)
    rows = tuple(
        (
            Cell(comparison.scene),
            Cell(f"{method_title(comparison.other)} / {method_title(comparison.baseline)}"),
            *(Cell(format_percent(comparison.differences[key])) for key in keys),
        )
        for comparison in comparisons
    )
    title = f"Relative difference of the error on {' and '.join(sets)} frames, paired by seed"
    return Table(title, ("scene", "methods", *keys.values()), rows, 2)


def _metric_columns(sets: Sequence[str]) -> dict[str, str]:
    """Key and name of every metric's column; a name tells the set where there are several."""
    return {
        f"{set_name}_{metric}": f"{set_name} {TITLES[metric]}" if len(sets) > 1 else TITLES[metric]
        for set_name in sets
        for metric in METRICS
    }


def _table(
    title: str,
    summaries: Sequence[Summary],
    keys: dict[str, str],
    text: Callable[[Estimate], str],
    *,
    mark_best: bool = True,
) -> Table:
    rows = []
    for summary in summaries:
        rivals = [s for s in summaries if s.scene == summary.scene and s.is_method]
        cells = [
            Cell(summary.scene),
            Cell(method_title(summary.method)),
            Cell(_seeds(summary)),
        ]
        for key in keys:
            value = summary.values.get(key)
            best = mark_best and summary.is_method and _is_best(value, key, rivals)
            cells.append(Cell(MISSING if value is None else text(value), best))
        rows.append(tuple(cells))
    return Table(title, ("scene", "method", "n", *keys.values()), tuple(rows), 2)


def _seeds(summary: Summary) -> str:
    """'3', or '3 (1 diverged)'; nothing for the reference noise."""
    n = str(len(summary.runs) or "")
    return f"{n} ({summary.diverged} diverged)" if summary.diverged else n


def _is_best(value: Estimate | None, key: str, rivals: Sequence[Summary]) -> bool:
    """Whether it is the lowest finite mean; a rival whose mean is NaN or Inf is beaten."""
    others = [rival.values[key] for rival in rivals]
    means = [other.mean for other in others if other is not None]
    if value is None or len(means) < 2 or not math.isfinite(value.mean):
        return False
    return value.mean == min(filter(math.isfinite, means))


def format_number(value: float, decimals: int | None = None) -> str:
    """Three significant digits, never more than five decimals."""
    if not math.isfinite(value):
        return str(value)
    return f"{value:.{_decimals(value) if decimals is None else decimals}f}"


def format_estimate(value: Estimate) -> str:
    """'0.123 ± 0.012', the interval to the mean's decimals."""
    if value.half_width is None:
        return format_number(value.mean)
    decimals = _decimals(value.mean)
    return f"{format_number(value.mean)} ± {format_number(value.half_width, decimals)}"


def format_percent(value: Estimate | None, decimals: int = 1) -> str:
    """'-12.3 ± 4.5 %'; missing too where it is undefined, for a baseline of 0."""
    if value is None or math.isnan(value.mean):
        return MISSING
    interval = "" if value.half_width is None else f" ± {100 * value.half_width:.{decimals}f}"
    return f"{100 * value.mean:+.{decimals}f}{interval} %"


def _decimals(value: float) -> int:
    if value == 0:
        return 3
    return min(5, max(0, 2 - math.floor(math.log10(abs(value)))))


def to_terminal(table: Table) -> str:
    """Plain text under its title; the best value of a scene carries a star."""
    rows = [[cell.text + " *" * cell.best for cell in row] for row in table.rows]
    return f"{table.title}\n{_grid(table, rows, 'simple')}"


def to_markdown(table: Table) -> str:
    """A GitHub table under a bold title; best values are bold."""

    def text(cell: Cell) -> str:
        escaped = cell.text.replace("|", "\\|").replace("_", "\\_").replace("*", "\\*")
        return f"**{escaped}**" if cell.best else escaped

    rows = [[text(cell) for cell in row] for row in table.rows]
    return f"**{table.title}**\n\n{_grid(table, rows, 'pipe')}"


def _grid(table: Table, rows: list[list[str]], style: str) -> str:
    alignment = ["left"] * table.labels + ["right"] * (len(table.columns) - table.labels)
    grid: str = tabulate(rows, table.columns, style, colalign=alignment, disable_numparse=True)
    return grid
