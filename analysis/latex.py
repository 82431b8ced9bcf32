"""Tables as LaTeX in the manner of the booktabs package."""

from __future__ import annotations

import re
from itertools import groupby

from analysis.tables import Cell, Table

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "×": r"$\times$",
    "≥": r"$\ge$",
    "≤": r"$\le$",
    "–": "--",
    "ε": r"$\varepsilon$",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
}


_LINE, _BROKEN = 50, r"p{9em}"

_MINUS = re.compile(r"(?<![^\s(])-(?=\d)")
"""Before a number; elsewhere it is a hyphen."""


def escape(text: str) -> str:
    """Text as LaTeX prints it literally, minus signs as such."""
    return "$-$".join(
        "".join(_SPECIAL.get(sign, sign) for sign in part) for part in _MINUS.split(text)
    )


def to_latex(table: Table) -> str:
    """A `table*` environment, as wide as the page, for documents that use the package booktabs.

    Column names that share their first word ('hard MAPE', 'hard MAE') get it as a common heading;
    a rule separates the scenes, and text longer than `_LINE` signs is broken into lines.
    """
    alignment = "r" * (len(table.columns) - table.labels)
    for column in reversed(range(table.labels)):
        longest = max((len(row[column].text) for row in table.rows), default=0)
        alignment = (_BROKEN if longest > _LINE else "l") + alignment
    label = re.sub(r"[^a-z0-9]+", "-", table.title.lower()).strip("-")
    caption = rf"\caption{{{escape(table.title)}}}\label{{tab:{label}}}"
    lines = [r"\begin{table*}", caption, r"\centering\small\setlength{\tabcolsep}{4pt}"]
    lines += [rf"\begin{{tabular}}{{{alignment}}}", r"\toprule", *_heading(table.columns)]
    for _, rows in groupby(table.rows, key=lambda row: row[0].text):
        lines.append(r"\midrule")
        lines += [" & ".join(_cell(cell) for cell in row) + r" \\" for row in rows]
    lines += [r"\bottomrule", r"\end{tabular}", r"\end{table*}"]
    return "\n".join(lines)


def _cell(cell: Cell) -> str:
    text = escape(cell.text)
    if len(cell.text) > _LINE:
        return rf"\raggedright {text}"
    return rf"\textbf{{{text}}}" if cell.best else text


def _heading(columns: tuple[str, ...]) -> list[str]:
    split = [column.split(" ", 1) if " " in column else ["", column] for column in columns]
    groups = [(name, len(list(group))) for name, group in groupby(first for first, _ in split)]
    if not any(name and size > 1 for name, size in groups):
        return [" & ".join(escape(column) for column in columns) + r" \\"]
    cells, rules, position = [], [], 1
    for name, size in groups:
        if name:
            cells.append(rf"\multicolumn{{{size}}}{{c}}{{{escape(name)}}}")
            rules.append(rf"\cmidrule(lr){{{position}-{position + size - 1}}}")
        else:
            cells += [""] * size
        position += size
    names = " & ".join(escape(second) for _, second in split)
    return [" & ".join(cells) + r" \\", "".join(rules), names + r" \\"]
