"""Figures as text: a list for the terminal, tables in Markdown with a row per scene."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from ngi.studies.benchmark.figures import Figure


def table(figures: Sequence[Figure]) -> str:
    """A heading per part of the benchmark, below it a line per figure."""
    width = max(len(_label(f)) for f in figures)
    lines = []
    for part, group in groupby(figures, lambda f: f.part):
        lines += ["", part, *(f"  {_label(f):<{width}}  {_line(f)}" for f in group)]
    return "\n".join(lines[1:])


def markdown(figures: Sequence[Figure]) -> str:
    """Per part a table with a row per scene that was rendered, and one of all other figures."""
    parts: dict[str, list[Figure]] = {}
    for figure in figures:
        parts.setdefault(figure.part, []).append(figure)
    return "\n\n".join(
        "\n\n".join([f"### {part}", *_tables(group)]) for part, group in parts.items()
    )


def number(x: float) -> str:
    return f"{x:,.0f}" if abs(x) >= 1000 else f"{x:.4g}"


def _label(figure: Figure) -> str:
    return ": ".join(filter(None, (figure.scene, figure.name)))


def _line(figure: Figure) -> str:
    wanted = f"  wanted {figure.limit}" if figure.limit else ""
    return f"{number(figure.median):>9} {figure.unit}{_quartiles(figure)}{wanted}"


def _quartiles(figure: Figure) -> str:
    if figure.lower == figure.upper:
        return ""
    return f" ({number(figure.lower)} – {number(figure.upper)})"


def _tables(figures: Sequence[Figure]) -> list[str]:
    of_scenes = [figure for figure in figures if figure.scene]
    others = [figure for figure in figures if not figure.scene]
    return [make(some) for make, some in ((_by_scene, of_scenes), (_by_figure, others)) if some]


def _by_figure(figures: Sequence[Figure]) -> str:
    rows = [
        (f.name, f"{number(f.median)} {f.unit}{_quartiles(f)}", f.limit or " ") for f in figures
    ]
    return _rows(("what", "measured", "wanted"), rows)


def _by_scene(figures: Sequence[Figure]) -> str:
    columns = list(dict.fromkeys(map(_heading, figures)))
    cells = {(f.scene, _heading(f)): f"{number(f.median)}{_quartiles(f)}" for f in figures}
    scenes = dict.fromkeys(f.scene for f in figures)
    rows = [(scene, *(cells.get((scene, column), "–") for column in columns)) for scene in scenes]
    return _rows(("scene", *columns), rows)


def _heading(figure: Figure) -> str:
    wanted = f"wanted {figure.limit}" if figure.limit else ""
    return ", ".join(filter(None, (figure.name, figure.unit, wanted)))


def _rows(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heading, [":--", *("--:" for _ in heading[1:])], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
