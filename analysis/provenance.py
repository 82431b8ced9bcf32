"""Where every number comes from: commit, configuration, scene, references, machine of each run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import pandas as pd

from analysis.methods import title
from analysis.runs import Run
from analysis.tables import MISSING, Cell, Table

SHOWN_DIGITS = 12
"""Of commits and hashes in tables; provenance.csv has them whole."""

THEN = " then "
"""Between the commits of a run that was interrupted and went on with another one."""

_COLUMNS = {
    "commit": "commit",
    "dirty": "changed files",
    "identity": "configuration",
    "scene_hash": "scene files",
    "reference_hash": "references",
    "protocol": "protocol",
    "machine": "machine",
}


def provenance_frame(runs: Sequence[Run]) -> pd.DataFrame:
    """A row per run, everything in full; `machine` is its number in `machine_table`."""
    machines = _machines(runs)
    rows = []
    for run in runs:
        result = run.result
        rows.append(
            {
                "scene": run.scene,
                "method": run.method,
                "seed": run.seed,
                "commit": THEN.join(_commits(run)) or None,
                "dirty": any(v.get("dirty") for v in run.versions),
                "identity": result.get("identity"),
                "scene_hash": result["scene_hash"],
                "reference_hash": result["reference_hash"],
                "protocol": result["protocol"]["identity"],
                "machine": 1 + list(machines).index(_machine_key(run)),
                "folder": str(run.folder),
            }
        )
    return pd.DataFrame(rows)


def provenance_table(runs: Sequence[Run]) -> Table:
    """`provenance_frame` with hashes cut to `SHOWN_DIGITS`, and without folders."""
    rows = tuple(
        (
            Cell(row["scene"]),
            Cell(title(row["method"])),
            Cell(str(row["seed"])),
            *(Cell(_shown(row[key])) for key in _COLUMNS),
        )
        for row in provenance_frame(runs).to_dict("records")
    )
    return Table(
        "Provenance of every run", ("scene", "method", "seed", *_COLUMNS.values()), rows, 2
    )


def machine_table(runs: Sequence[Run]) -> Table:
    """Every distinct machine and set of versions, numbered in the order of the runs."""
    rows = tuple(
        (Cell(str(number)), Cell(_listed(machine)), Cell(_listed(versions)))
        for number, (machine, versions) in enumerate(_machines(runs).values(), start=1)
    )
    return Table("Machines and versions", ("machine", "what it is", "versions"), rows, 3)


def _commits(run: Run) -> dict[str, None]:
    """Of the run's versions, each once and in order; none outside git."""
    return dict.fromkeys(version["commit"] for version in run.versions if version["commit"])


def _machines(runs: Sequence[Run]) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    return {
        _machine_key(run): (run.result.get("machine", {}), run.result.get("versions", {}))
        for run in runs
    }


def _machine_key(run: Run) -> str:
    return json.dumps([run.result.get(key, {}) for key in ("machine", "versions")], sort_keys=True)


def _listed(entries: dict[str, Any]) -> str:
    """'cores 2, processor AMD EPYC'; what is unknown (null) is left out."""
    known = (f"{key} {value}" for key, value in sorted(entries.items()) if value is not None)
    return ", ".join(known) or MISSING


def _shown(value: Any) -> str:
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    return THEN.join(part[:SHOWN_DIGITS] for part in str(value).split(THEN))
