"""A binary file that grows record by record and can be cut back to an earlier step.

It is for arrays, as `RowLog` is for numbers, and NumPy alone reads it.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike

from ngi.files.durable import damage_named, full_disk_named
from ngi.files.growing_file import GrowingFile

MOST_VARIABLES = 62
"""Positions are left out in scenes of more variables: their files would grow to gigabytes."""

CHAINS = (
    "One record per generated batch of n chains; step as in steps.csv. "
    "position [n, S]: the proposals, scene variables and then patch position, in [0, 1] "
    f"(left out in scenes of more than {MOST_VARIABLES} variables). "
    "large_step, accepted [n]: a chain that accepted stands at its proposal, any other where it "
    "stood. initialised [n]: the chain held no state before. "
    "target_proposed, target_current [n]: target density of the proposal and of the state before, "
    "under the weights of that step; NaN where it was not computed."
)

TARGET_MAPS = (
    "One record per evaluation; step and run_seconds as in metrics.csv. state [g, g, k, 4]: k "
    "patches in each of g x g cells of [0, 1]^2, scene variables and then patch position, the same "
    "in every record; the first index is the cell along the first scene variable. loss, target "
    "[g, g, k]: their training loss and target density."
)


class RecordLog(GrowingFile[BinaryIO]):
    """Records of equal size with an ascending `step`, appended to a file.

    The first line is JSON: `description`, and `fields`, a list of name, NumPy type and shape. The
    records follow without gaps, each the bytes of its fields in this order. The fields are those
    of the file, or else of the first record.

    description: says in the file what the fields mean
    Raises ValueError for a record with other fields, types or shapes, and for a damaged first line.
    """

    def __init__(self, path: Path, *, description: str) -> None:
        super().__init__(path)
        self._description = description
        self._dtype = np.dtype([])

    def append(self, record: Mapping[str, ArrayLike]) -> None:
        arrays = {name: np.asarray(value) for name, value in record.items()}
        dtype = np.dtype([(name, array.dtype, array.shape) for name, array in arrays.items()])
        if self._stream is None:
            with full_disk_named(self.path):
                self._open(dtype)
        assert self._stream is not None
        if dtype != self._dtype:
            raise ValueError(
                f"{self.path}: a record of {_fields(dtype)} does not fit the file's records of "
                f"{_fields(self._dtype)}; a run with other arrays needs a folder of its own"
            )
        with full_disk_named(self.path):
            self._stream.write(b"".join(array.tobytes() for array in arrays.values()))

    def keep_until(self, step: int) -> int:
        """Drops records after `step` and returns how many.

        What a run did after its last checkpoint is done again.
        """
        self.close()
        if not self.path.exists():
            return 0
        with self.path.open("rb") as stream:
            dtype = self._read_header(stream)
            if dtype is None:
                size = dropped = 0
            else:
                start = stream.tell()
                steps = self._steps(dtype, start)
                # What a power cut leaves may be zeros: only what ascends from the start counts.
                good = (steps <= step) & (np.diff(steps, prepend=-1) > 0)
                kept = int(np.logical_and.accumulate(good).sum())
                size, dropped = start + dtype.itemsize * kept, len(steps) - kept
        os.truncate(self.path, size)
        return dropped

    def _steps(self, dtype: np.dtype, start: int) -> np.ndarray:
        """Of the records that begin at `start`; one cut short is left out."""
        count = (self.path.stat().st_size - start) // dtype.itemsize
        if not count:
            return np.empty(0, int)
        records = np.memmap(self.path, dtype, mode="r", offset=start, shape=(count,))
        return np.array(records["step"])

    def _open(self, dtype: np.dtype) -> None:
        if self.path.exists():
            with self.path.open("rb") as stream:
                dtype_there = self._read_header(stream)
        else:
            dtype_there = None
        self._stream = self.path.open("ab")
        self._dtype = dtype if dtype_there is None else dtype_there
        if dtype_there is None:
            header = {"description": self._description, "fields": _fields(dtype)}
            self._stream.write(json.dumps(header).encode() + b"\n")

    def _read_header(self, stream: BinaryIO) -> np.dtype | None:
        """None where the first line was cut short, before any record was written."""
        line = stream.readline()
        if not line.endswith(b"\n"):
            return None
        advice = (
            "its first line describes the records; restore it from a copy, or delete it and the "
            "same command begins a new one at the last checkpoint"
        )
        with damage_named(self.path, advice):
            return np.dtype([(n, t, tuple(shape)) for n, t, shape in json.loads(line)["fields"]])


def _fields(dtype: np.dtype) -> list[list[object]]:
    return [[name, dtype[name].base.str, list(dtype[name].shape)] for name in dtype.names or ()]
