"""How steady networks are in motion: what `ngi video` measured, as tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from os.path import relpath
from pathlib import Path
from typing import Any

from analysis.methods import title
from analysis.runs import Run
from analysis.tables import MISSING, Cell, Table

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
    """A table per measure that the films below `folder` have, and a warning for what is left out.

    That is a film that cannot be read, and what one shows of a run that has changed since.

    runs: named, so that a film of theirs calls them as every other table does
    """
    reported = {run.folder.resolve(): run for run in runs}
    rows: dict[str, list[tuple[Cell, ...]]] = {measure: [] for measure in TITLES}
    warnings = []
    for file in sorted(folder.rglob(FILES)):
        try:
            film = json.loads(file.read_text())
            networks, reasons = _networks(film, file, folder, reported)
            rows[film["measure"]] += _rows(film, networks)
        except (OSError, ValueError, KeyError, TypeError) as error:
            reasons = [f"not a film that can be read ({error!r})"]
        warnings += [f"left out: {file}: {reason}" for reason in reasons]
    return [_table(measure, found) for measure, found in rows.items() if found], warnings


def _networks(
    film: dict[str, Any], file: Path, folder: Path, reported: dict[Path, Run]
) -> tuple[dict[str, str], list[str]]:
    """By label, what the table calls the film's networks; and why it is without some of them.

    None of a film that measured nothing.
    One that is not in the report, as its run was interrupted for example, is called by its run's
    folder, as seen from the report's, and its step. What an older film does not say is not checked.
    """
    shown, reasons = {}, []
    for entry in film["runs"] if film["measured"] else ():
        place, step = (file.parent / entry["folder"]).resolve(), entry.get("step")
        run = reported.get(place)
        if run is None:
            steps = f", step {step}" if step else ""
            shown[entry["label"]] = f"{relpath(place, folder.resolve())}{steps}"
        elif film.get("scene_hash") not in (None, run.result["scene_hash"]):
            return {}, [f"{run.folder} has another version of the scene: film it again"]
        elif step not in (None, run.result["steps"]):
            trained = f"{run.folder} has {run.result['steps']} steps"
            reasons.append(f"film of step {step}, {trained}: film it again")
        else:
            shown[entry["label"]] = f"{title(run.method)}, seed {run.seed}"
    return shown, reasons


def _rows(film: dict[str, Any], networks: dict[str, str]) -> list[tuple[Cell, ...]]:
    """A row per panel of these networks, and of what is no network's where there are some.

    The steadiest of several networks is marked.
    """
    measured, filmed = film["measured"], [run["label"] for run in film["runs"]]
    where = _where(film)
    rows = []
    for label, values in measured.items():
        if not networks or (label in filmed and label not in networks):
            continue
        cells = [Cell(text) for text in (*where, networks.get(label, label))]
        for name in VALUES[film["measure"]]:
            rivals = [measured[network][name] for network in networks]
            best = label in networks and len(rivals) > 1 and values[name] == min(rivals)
            cells.append(Cell(f"{values[name]:.3g}", best))
        rows.append(tuple(cells))
    return rows


def _where(film: dict[str, Any]) -> tuple[str, str, str, str]:
    """What tells films of the same networks apart, a cell each; older ones lack some options."""
    options = film["options"]
    path, samples = options["path"], options.get("reference")
    still = path == "static" and "hard_frame" in options
    edges = ", supersampled edges" if options.get("supersampled_edges") else ""
    return (
        film["scene"],
        f"{path}, hard frame {options['hard_frame']}" if still else path,
        f"{film['frames']} × {options['resolution']}²{edges}",
        f"{samples:,} spp" if samples else MISSING,
    )


def _table(measure: str, rows: Sequence[tuple[Cell, ...]]) -> Table:
    where = ("scene", "path", "frames", "reference")
    columns = (*where, "shown", *VALUES[measure].values())
    return Table(TITLES[measure], columns, tuple(rows), len(where) + 1)
