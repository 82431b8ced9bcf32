"""What a run takes of its machine, so that a long one can be seen not to grow."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from ngi.machine.memory import allocated_bytes, resident_bytes

COLUMNS = ("resident_bytes", "allocated_bytes", "open_files", "folder_bytes", "cpu_seconds")


def usage(folder: Path) -> dict[str, float | None]:
    """By `COLUMNS`: memory of this process, in use too, open files, folder size, processor time.

    The first three are None where the system does not say (Linux with glibc does). Processor time
    is this process's since it began, of all its threads.
    """
    files = Path("/proc/self/fd")
    values = (
        resident_bytes(),
        allocated_bytes(),
        len(list(files.iterdir())) if files.exists() else None,
        _folder_bytes(folder),
        time.process_time(),
    )
    return dict(zip(COLUMNS, values, strict=True))


def _folder_bytes(folder: Path) -> int:
    total = 0
    for path in folder.rglob("*"):
        with suppress(OSError):  # renamed meanwhile, as W&B's files are
            total += path.stat().st_size if path.is_file() else 0
    return total
