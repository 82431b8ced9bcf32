"""The memory of this process, which stays for speed, and what else a run takes of its machine."""

import ctypes
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

M_TRIM_THRESHOLD, M_TOP_PAD, M_MMAP_THRESHOLD = -1, -2, -3  # of glibc's malloc.h


def keep_freed_memory() -> None:
    """Has glibc keep large blocks that were freed, instead of giving them back to the kernel.

    Every training step frees and allocates tensors of megabytes; given back, their pages are
    mapped and zeroed anew each time, which took a fifth of a 6x128 step on two cores. Does
    nothing where the C library is another one.
    """
    mallopt = _of_c_library("mallopt")
    if mallopt is None:
        return
    mallopt(M_MMAP_THRESHOLD, 32 * 2**20)  # the largest it accepts
    mallopt(M_TRIM_THRESHOLD, 2**31 - 1)
    mallopt(M_TOP_PAD, 64 * 2**20)


def resident_bytes() -> int | None:
    """Main memory that this process holds; None where the system does not say."""
    statistics = Path("/proc/self/statm")
    if not statistics.exists():
        return None
    return int(statistics.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class _Mallinfo2(ctypes.Structure):
    """glibc's malloc.h; of all arenas together."""

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    )


def allocated_bytes() -> int | None:
    """Main memory that is in use: what malloc gave out and has not got back.

    None where the C library is not glibc 2.33 or newer. `resident_bytes` holds freed memory too,
    which stays, and goes up whenever the heap's so far untouched part is touched.
    """
    mallinfo2 = _of_c_library("mallinfo2")
    if mallinfo2 is None:
        return None
    mallinfo2.restype = _Mallinfo2
    found = mallinfo2()
    return int(found.uordblks + found.hblkhd)


def _of_c_library(name: str) -> Any:
    """A function of the C library. None if there is no such function, or outside Linux."""
    if not sys.platform.startswith("linux"):
        return None
    return getattr(ctypes.CDLL(None), name, None)


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
    for parent, _, names in os.walk(folder):  # which passes over folders that are gone meanwhile
        for name in names:
            with suppress(OSError):  # renamed meanwhile, as W&B's files are
                total += Path(parent, name).stat().st_size
    return total
