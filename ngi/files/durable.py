"""Files that survive a crash, a power cut and a full disk, or say clearly that they could not."""

import io
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PARTIAL_SUFFIX = ".partial"
"""Of files that are being written; one that is left was cut short and means nothing."""


class DamagedError(ValueError):
    """A file's content is not what was written into it, or the file is gone."""


@contextmanager
def damage_named(path: Path, advice: str = "") -> Iterator[None]:
    """What is raised where content lacks what belongs there becomes a `DamagedError`.

    It names the file and says what to do, advice. Errors of reading the file are passed on.
    """
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        what = f"{path} is damaged ({type(error).__name__}: {error})"
        raise DamagedError("; ".join(filter(None, (what, advice)))) from error


@contextmanager
def full_disk_named(path: Path) -> Iterator[None]:
    """An OSError inside gets the file's name and what to do about it."""
    try:
        yield
    except OSError as error:
        advice = "Free disk space (or change the folder's permissions)"
        if isinstance(error, FileNotFoundError):  # what was written is gone already
            advice = "Another process may be writing it too: stop all but one of them"
        raise OSError(
            error.errno,
            f"{error.strerror}: this file could not be written; earlier checkpoints are intact. "
            f"{advice}, then start the same command again",
            str(path),
        ) from error


def write_atomically(
    path: Path,
    content: bytes | memoryview | Iterable[bytes],
    *,
    keep_old_as: Path | None = None,
) -> None:
    """Replaces a file so that a crash at any time leaves either the old content or the new one.

    content: in one piece, or in pieces, which may be read from the old one meanwhile
    keep_old_as: gets the old content, in the same folder; a crash may leave just that, under that
        name. None: the old content goes.

    Once it returns the file survives a power cut. Raises OSError with what to do where the disk
    is full; the old files stay then, and no half file does.
    """
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with full_disk_named(path):
            with partial.open("wb") as stream:
                stream.writelines([content] if isinstance(content, bytes | memoryview) else content)
                stream.flush()
                os.fsync(stream.fileno())
            if keep_old_as is not None and path.exists():
                os.replace(path, keep_old_as)
            os.replace(partial, path)
            _fsync_folder(path.parent)
    except OSError:
        partial.unlink(missing_ok=True)
        raise


def write_tensors(path: Path, content: dict[str, Any]) -> None:
    """`write_atomically` of what `torch.load` reads; the folder is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # Let go of by hand: Python 3.12.1 crashes when its garbage collection finds the view in the
    # traceback of a full disk's error (CPython's issues 77894 and 111049).
    with serialised(content).getbuffer() as view:
        write_atomically(path, view)


def serialised(content: dict[str, Any]) -> io.BytesIO:
    """What torch.save writes, which in a file would hide the OSError of a full disk."""
    import torch

    stream = io.BytesIO()
    torch.save(content, stream)
    return stream


def _fsync_folder(folder: Path) -> None:
    """A new name is on the disk only once its folder is."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
