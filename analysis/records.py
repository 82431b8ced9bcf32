"""Reads the binary logs that training writes: chains.bin, target_map.bin."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np


def read_records(path: Path) -> np.ndarray | None:
    """A structured array [records] with the fields that the file's first line names, or None.

    None where there is no such file, or no record in it yet; a record cut short is left out.
    Raises ValueError where the first line is damaged.
    """
    if not path.exists() or not (content := path.read_bytes()):
        return None
    header, _, content = content.partition(b"\n")
    try:
        fields = json.loads(header)["fields"]
        dtype = np.dtype([(name, kind, tuple(shape)) for name, kind, shape in fields])
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} is damaged (first line: {error}); move the run away") from error
    return np.frombuffer(content, dtype, count=len(content) // dtype.itemsize)
