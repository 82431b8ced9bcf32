"""A CSV file that grows row by row and can be cut back to an earlier step."""

import csv
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, TextIO

from ngi.files.durable import full_disk_named, write_atomically
from ngi.files.growing_file import GrowingFile

BLOCK = 1 << 16
"""Bytes that are read at once from a log's end."""


class RowLog(GrowingFile[TextIO]):
    """Rows with a `step` column, appended to a CSV file.

    The columns are those of the file, or else of the first row; values missing later stay empty.
    Raises ValueError for a row with a column that the first row did not have. In a file that is
    continued, which an older version may have begun, such values are left out.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._writer: csv.DictWriter[str] | None = None

    def append(self, row: Mapping[str, object]) -> None:
        with full_disk_named(self.path):
            if self._stream is None:
                self._open(list(row))
            assert self._writer is not None
            self._writer.writerow(row)

    def rows(self) -> list[dict[str, str]]:
        """What is on the disk, as text."""
        if not self.path.exists():
            return []
        with self.path.open(newline="") as stream:
            return list(csv.DictReader(stream))

    @property
    def last_row(self) -> dict[str, str] | None:
        """The last whole one that is on the disk, as text; None where there is none."""
        if not self.path.exists():
            return None
        with self.path.open("rb") as stream:
            header = stream.readline()
            if (column := _step_column(header)) is None:
                return None
            rows = _lines_backwards(stream, until=stream.tell())
            last = next((row for row in rows if _step(row, column) is not None), None)
        return None if last is None else next(csv.DictReader([header.decode(), last.decode()]))

    @property
    def last_step(self) -> int:
        """Of the last row that is on the disk, 0 where there is none."""
        row = self.last_row
        return 0 if row is None else int(row["step"])

    def keep_until(self, step: int) -> int:
        """Drops rows after `step` and returns how many.

        What a run did after its last checkpoint is done again.
        """
        self.close()
        if not self.path.exists() or not self.path.stat().st_size:
            return 0
        dropped = 0

        def kept() -> Iterator[bytes]:
            nonlocal dropped
            with self.path.open("rb") as stream:
                header = stream.readline()
                if (column := _step_column(header)) is None:
                    dropped = 1 + sum(1 for _ in stream)
                    return
                yield header
                for line in stream:
                    its = _step(line, column)
                    if its is not None and its <= step:
                        yield line
                    else:
                        dropped += 1

        write_atomically(self.path, kept())
        return dropped

    def _open(self, columns: list[str]) -> None:
        continued = self.path.exists() and self.path.stat().st_size > 0
        if continued:
            with self.path.open(newline="") as stream:
                columns = next(csv.reader(stream))
        self._stream = self.path.open("a", newline="")
        self._writer = csv.DictWriter(
            self._stream,
            columns,
            restval="",
            extrasaction="ignore" if continued else "raise",
            lineterminator="\n",
        )
        if not continued:
            self._writer.writeheader()


def _lines_backwards(stream: BinaryIO, *, until: int) -> Iterator[bytes]:
    """Those of a file from its last one to the one that begins at a position.

    They are read in blocks: logs of long runs have gigabytes.
    """
    end, rest = stream.seek(0, os.SEEK_END), b""
    while end > until:
        start = max(until, end - BLOCK)
        stream.seek(start)
        rest, *whole = (stream.read(end - start) + rest).splitlines(keepends=True)
        yield from reversed(whole)
        end = start
    if rest:
        yield rest


def _step_column(header: bytes) -> int | None:
    """Where rows have their step; None where the header was cut short by a crash, too."""
    names = _fields(header)
    return names.index("step") if "step" in names and header.endswith(b"\n") else None


def _step(line: bytes, column: int) -> int | None:
    """Of a row; None for one cut short by a crash: it has no newline or step, and its numbers
    can't be trusted.
    """
    fields = _fields(line.replace(b"\0", b""))
    whole = line.endswith(b"\n") and len(fields) > column and fields[column].isdigit()
    return int(fields[column]) if whole else None


def _fields(line: bytes) -> list[str]:
    return next(csv.reader([line.decode(errors="replace")]), [])
