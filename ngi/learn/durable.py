"""Files that survive a crash, a power cut and a full disk, or say clearly that they could not."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def full_disk_named(path: Path) -> Iterator[None]:
    """An OSError inside gets the file's name and what to do about it."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"{path} could not be written ({error.strerror or error}); earlier results are intact. "
            "Make room, and the same command goes on from the last checkpoint"
        ) from error


def write_atomically(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Replaces a file so that a crash at any time leaves either the old content or the new one.

    write: gets the stream of a temporary file beside it
    Raises OSError with what to do where the disk is full; the old file stays, no half file does.
    """
    temporary = path.with_name(path.name + ".tmp")
    try:
        with full_disk_named(path):
            with temporary.open("wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(path)
            _fsync_folder(path.parent)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise


def _fsync_folder(folder: Path) -> None:
    """A new name is on the disk only once its folder is."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
