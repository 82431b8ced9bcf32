"""How steady networks are in motion: what `ngi video` measured, as tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.methods import title
from analysis.runs import Run
from analysis.tables import Cell, Table

FILES = "video*.json"

TITLES = {
    "temporal_error": "Error of the changes from frame to frame, along a path",
    "flicker": "Flicker, where nothing moves",
}
VALUES = {
    "temporal_error": {"srgb": "sRGB", "relative": "relative", "mean_square": "mean square"},
    "flicker": {"srgb": "sRGB", "relative": "relative"},
}
"""By measure: what a film's file and the table call its values, see ngi/evaluate/temporal.py."""


def film_tables(folder: Path, runs: Sequence[Run]) -> tuple[list[Table], list[str]]:
    """A table per measure that the films below `folder` have, and a warning per unreadable film.

    runs: named, so that a film of theirs calls them as every other table does
    """
    titles = {run.folder.resolve(): f"{title(run.method)}, seed {run.seed}" for run in runs}
    rows: dict[str, list[tuple[Cell, ...]]] = {measure: [] for measure in TITLES}
    warnings = []
    for file in sorted(folder.rglob(FILES)):
        try:
            film = json.loads(file.read_text())
            rows[film["measure"]] += _rows(film, file.parent, titles)
        except (OSError, ValueError, KeyError, TypeError) as error:
            warnings.append(f"left out: {file}: not a film that can be read ({error!r})")
    return [_table(measure, found) for measure, found in rows.items() if found], warnings


def _rows(film: dict[str, Any], folder: Path, titles: dict[Path, str]) -> list[tuple[Cell, ...]]:
    """A row per panel; the steadiest of several networks is marked."""
    networks = {run["label"]: (folder / run["folder"]).resolve() for run in film["runs"]}
    measured, options = film["measured"], film["options"]
    where = (film["scene"], options["path"], f"{film['frames']} × {options['resolution']}²")
    rows = []
    for label, values in measured.items():
        shown = titles.get(networks[label], label) if label in networks else label
        cells = [Cell(text) for text in (*where, shown)]
        for name in VALUES[film["measure"]]:
            rivals = [measured[network][name] for network in networks]
            best = label in networks and len(rivals) > 1 and values[name] == min(rivals)
            cells.append(Cell(f"{values[name]:.3g}", best))
        rows.append(tuple(cells))
    return rows


def _table(measure: str, rows: Sequence[tuple[Cell, ...]]) -> Table:
    columns = ("scene", "path", "frames", "shown", *VALUES[measure].values())
    return Table(TITLES[measure], columns, tuple(rows), 4)
