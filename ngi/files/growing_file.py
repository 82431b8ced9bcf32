"""What files that grow while a run goes on have in common."""

import hashlib
import os
from pathlib import Path
from typing import BinaryIO, Generic, TextIO, TypeVar

from ngi.files.durable import full_disk_named

Stream = TypeVar("Stream", TextIO, BinaryIO)


class GrowingFile(Generic[Stream]):
    """A file that is opened at the first `append` of a subclass, and is on the disk after `flush`.

    Raises OSError, with what to do, where the disk is full.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stream: Stream | None = None

    def flush(self) -> None:
        """Brings everything appended to the disk."""
        if self._stream is not None:
            with full_disk_named(self.path):
                self._stream.flush()
                os.fsync(self._stream.fileno())

    def fingerprint(self) -> dict[str, int | str] | None:
        """Length in bytes and SHA-256 of what is in the file, or None where there is none."""
        self.flush()
        if not self.path.exists():
            return None
        with self.path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
            return {"bytes": stream.tell(), "sha256": digest}

    def close(self) -> None:
        """The next `append` opens it again."""
        stream, self._stream = self._stream, None
        if stream is not None:
            with full_disk_named(self.path):
                stream.close()
