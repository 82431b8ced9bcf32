"""A CSV file that grows row by row and can be cut back to an earlier step."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import TextIO

from ngi.files.durable import full_disk_named, write_atomically
from ngi.files.growing_file import GrowingFile


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
        lines = self._lines()
        if (column := _step_column(lines)) is None:
            return None
        whole = (line for line in reversed(lines[1:]) if _step(line, column) is not None)
        last = next(whole, None)
        return None if last is None else next(csv.DictReader([lines[0], last]))

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
        if not (lines := self._lines()):
            return 0
        kept = []
        if (column := _step_column(lines)) is not None:
            steps = [(_step(line, column), line) for line in lines[1:]]
            kept = [lines[0], *(line for its, line in steps if its is not None and its <= step)]
        write_atomically(self.path, "".join(kept).encode())
        return len(lines) - len(kept)

    def _lines(self) -> list[str]:
        if not self.path.exists():
            return []
        with self.path.open(newline="") as stream:
            return stream.readlines()

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


def _step_column(lines: list[str]) -> int | None:
    """Where rows have their step; None where the header was cut short by a crash, too."""
    header = next(csv.reader(lines[:1]), [])
    return header.index("step") if "step" in header and lines[0].endswith("\n") else None


def _step(line: str, column: int) -> int | None:
    """Of a row; None for one cut short by a crash: it has no newline or step, and its numbers
    can't be trusted.
    """
    fields = next(csv.reader([line.replace("\0", "")]), [])
    whole = line.endswith("\n") and len(fields) > column and fields[column].isdigit()
    return int(fields[column]) if whole else None
