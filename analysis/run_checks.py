"""Whether a finished run's files are whole: its result file, and the logs beside it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

SETS = ("hard", "uniform")
METRICS = ("mape", "dssim", "mae", "lpips")

DISTINCTIONS = ("reuse", "resolution", "model", "loss", "budget", "overrides", "experiment")
"""Label fields that tell methods of one sampler apart, the most telling first."""


def check_result(result: dict[str, Any]) -> None:
    """Touches everything that is read later, so that what lacks is known before any output.

    Raises KeyError for what is missing, TypeError, naming key and value, for what is no number.
    """
    for key in ("scene_hash", "reference_hash", "patches_traced", "paths_traced"):
        _ = result[key]
    _ = result["protocol"]["name"], result["protocol"]["identity"]
    for key in ("scene", "sampler", *DISTINCTIONS):
        _ = result["label"][key]
    for recorded in result.get("logs", {}).values():
        _ = recorded["bytes"], recorded["sha256"]
    for key, value in _numbers(result):
        if not isinstance(value, int | float):
            raise TypeError(f"{key} is {value!r}, which is no number")


def _numbers(result: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Key and value of what is calculated with; a metric that was not measured is left out."""
    for key in ("seed", "run_seconds", "steps"):
        yield key, result[key]
    for set_name in SETS:
        for metric in METRICS:
            if (summary := result["metrics"][set_name][metric]) is not None:
                for statistic in ("mean", "worst5", "floor"):
                    yield f"metrics.{set_name}.{metric}.{statistic}", summary[statistic]
    for number, frame in enumerate(result["frames"]):
        yield f"frames.{number}.index", frame["index"]
        for metric in METRICS:
            if frame[metric] is not None:
                yield f"frames.{number}.{metric}", frame[metric]


def check_logs(folder: Path, result: dict[str, Any]) -> None:
    """Raises ValueError, naming the file, for a log that is not what the run wrote.

    Length and SHA-256 are compared with those in the result file. Runs of before they were recorded
    are asked less: that the last evaluation is the one that the result is from.
    """
    for name, recorded in result.get("logs", {}).items():
        file = folder / name
        if not file.is_file():
            raise ValueError(f"{name} is gone; put back a copy")
        if (size := file.stat().st_size) != recorded["bytes"]:
            raise ValueError(
                f"{name} is damaged: it has {size:,} bytes, the run wrote {recorded['bytes']:,}; "
                "put back a copy"
            )
        with file.open("rb") as stream:
            if hashlib.file_digest(stream, "sha256").hexdigest() != recorded["sha256"]:
                raise ValueError(
                    f"{name} is damaged: its checksum is not the one in result.json; "
                    "put back a copy"
                )
    if "logs" not in result:
        last = read_table(folder / "metrics.csv")["step"].iloc[-1]
        if last != result["steps"]:
            raise ValueError(
                f"metrics.csv is cut short: it ends with step {last}, the run with step "
                f"{result['steps']}; put back a copy"
            )


def read_table(file: Path) -> pd.DataFrame:
    """A log of numbers with the columns 'step' and 'run_seconds' and at least one row.

    Raises ValueError, naming the file, for one that is missing or is something else.
    """
    try:
        table = pd.read_csv(file)
    except (OSError, ValueError) as error:
        raise ValueError(f"{file.name} cannot be read ({error})") from error
    for needed in ("step", "run_seconds"):
        if needed not in table:
            raise ValueError(f"{file.name} cannot be read (no column '{needed}')")
    if not len(table):
        raise ValueError(f"{file.name} has no row")
    for column, values in table.select_dtypes(exclude="number").items():
        row = pd.to_numeric(values, errors="coerce").isna() & values.notna()
        line = int(row.to_numpy().argmax())
        raise ValueError(
            f"{file.name}, line {line + 2}: {column} is {values.iloc[line]!r}, which is no number"
        )
    return table
