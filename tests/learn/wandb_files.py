"""What Weights & Biases wrote offline, read back by its own reader."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

Record = dict[str, Any]


def offline_files(folder: Path) -> list[Path]:
    """Of a run, in the order in which its parts were begun."""
    files = (folder / "wandb").glob("offline-run-*/*.wandb")
    return sorted(files, key=lambda file: file.parent.name)


def records(file: Path) -> list[Record]:
    """All that is in the file, as `wandb leet inspect` prints it."""
    command = [sys.executable, "-m", "wandb", "leet", "inspect", "--json", str(file)]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [json.loads(line) for line in shown.splitlines() if line.startswith("{")]


def of_kind(found: list[Record], kind: str) -> Iterator[Any]:
    return (record[kind] for record in found if record["type"] == kind)


def history(found: list[Record]) -> list[Record]:
    """Rows by the names that they were logged by."""
    return [row["item"] for row in of_kind(found, "history")]


def summary(found: list[Record]) -> Record:
    """In the end."""
    return {k: v for part in of_kind(found, "summary") for k, v in part["update"].items()}
