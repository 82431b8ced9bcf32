"""Whether a finished run's files are whole: its result file, and the logs beside it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

SETS = ("hard", "uniform")
METRICS = ("mape", "dssim", "mae", "lpips")

FRAME_PARTS = ("buffers", "paths", "denoiser", "path tracing", "network")
"""Of a timed frame, as `ngi.methods.path_tracing.run` names them; the last two are whole frames."""

DISTINCTIONS = ("reuse", "resolution", "model", "loss", "budget", "overrides", "experiment")
"""Label fields that tell methods of one sampler apart, the most telling first."""


def check_result(result: dict[str, Any]) -> None:
    """Touches everything that is read later, so that what lacks is known before any output.

    Raises KeyError for what is missing, TypeError, naming key and value, for what is no number or
    no text, TypeError or AttributeError for what holds no entries.
    """
    for recorded in result.get("logs", {}).values():
        _ = recorded["bytes"], recorded["sha256"]
    _ = result["config"].items()
    for key in ("machine", "versions"):
        _ = result.get(key, {}).items()
    for version in result.get("commits", []):
        _ = version["commit"], version.get("dirty")
    for key, value in _texts(result):
        if not isinstance(value, str):
            raise TypeError(f"{key} is {value!r}, which is not a text")
    for key, value in _numbers(result):
        if not isinstance(value, int | float) or not _fits(value):
            raise TypeError(f"{key} is {str(value)!r:.80}, which is not a number")


def _texts(result: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Key and value of what names, sorts or is compared."""
    for key in ("scene_hash", "reference_hash"):
        yield key, result[key]
    for key in ("name", "identity"):
        yield f"protocol.{key}", result["protocol"][key]
    label = result["label"]
    for key in ("scene", "sampler", *DISTINCTIONS):
        yield f"label.{key}", label[key]
    if label.get("method") is not None:
        yield "label.method", label["method"]
    yield "clock", result.get("clock", "wall")
    yield "lpips_note", result.get("lpips_note") or ""
    for number, frame in enumerate(result["frames"]):
        yield f"frames.{number}.set", frame["set"]


def _numbers(result: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Key and value of what is calculated with; what was not measured is left out."""
    for key in ("seed", "run_seconds", "steps", "patches_traced", "paths_traced"):
        yield key, result[key]
    for key in ("wall_seconds", "energy_joules"):
        if result.get(key) is not None:
            yield key, result[key]
    yield from _entries("seconds", result["seconds"])
    if "frame" in result:
        yield "frame.samples_per_pixel", result["frame"]["samples_per_pixel"]
        for part in FRAME_PARTS:
            yield f"frame.milliseconds.{part}", result["frame"]["milliseconds"][part]
    if "frame_seconds" in result:
        for part in ("buffers", "inputs", "network"):
            yield f"frame_seconds.{part}", result["frame_seconds"][part]
    for set_name in SETS:
        for metric in METRICS:
            if (summary := result["metrics"][set_name][metric]) is not None:
                for statistic in ("mean", "worst5", "floor"):
                    yield f"metrics.{set_name}.{metric}.{statistic}", summary[statistic]
    for number, frame in enumerate(result["frames"]):
        for key in ("index", *METRICS):
            if key == "index" or frame[key] is not None:
                yield f"frames.{number}.{key}", frame[key]


def _entries(key: str, values: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    return ((f"{key}.{name}", value) for name, value in values.items() if value is not None)


def _fits(number: Any) -> bool:
    """Whether it can be a number with a point: a text can, too, but no integer of 400 digits."""
    try:
        float(number)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def check_logs(folder: Path, result: dict[str, Any]) -> None:
    """Raises ValueError, naming the file, for a log that is not what the run wrote.

    Length and SHA-256 are compared with those in the result file. Runs of before they were recorded
    are asked less: that the last evaluation is the one that the result is from.
    """
    for name, recorded in result.get("logs", {}).items():
        file = folder / name
        if not file.is_file():
            raise ValueError(f"{name} is missing; restore it from a copy")
        if (size := file.stat().st_size) != recorded["bytes"]:
            raise ValueError(
                f"{name} is damaged: it has {size:,} bytes, the run wrote {recorded['bytes']:,}; "
                "restore it from a copy"
            )
        with file.open("rb") as stream:
            if hashlib.file_digest(stream, "sha256").hexdigest() != recorded["sha256"]:
                raise ValueError(
                    f"{name} is damaged: its checksum is not the one in result.json; "
                    "restore it from a copy"
                )
    if "logs" not in result:
        last = read_table(folder / "metrics.csv")["step"].iloc[-1]
        if last != result["steps"]:
            raise ValueError(
                f"metrics.csv is cut short: it ends with step {last}, the run with step "
                f"{result['steps']}; restore it from a copy"
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
        row = values.notna() & ~values.map(_fits)
        line = int(row.to_numpy().argmax())
        found = f"{column} is {values.iloc[line]!r:.80}"
        raise ValueError(f"{file.name}, line {line + 2}: {found}, which is not a number")
    return table
