"""A run's folder: its identity, its files, and whether it is new, interrupted or finished."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from pathlib import Path
from typing import Any, TextIO

from ngi.learn.row_log import RowLog


class RunFolder:
    """The folder of one run. A run's identity is the hash of what decides its result.

    settings: everything that decides the result (resolved configuration, scene hash, version),
        as plain JSON data.
    Raises ValueError where the folder holds another run, RuntimeError where another process is
    training in it. Nothing in the folder is touched before that is known.
    """

    def __init__(self, path: Path, *, settings: dict[str, Any]) -> None:
        self.path = path
        self.settings = settings
        canonical = json.dumps(settings, sort_keys=True)
        self.identity = hashlib.sha256(canonical.encode()).hexdigest()[:16]
        self.checkpoint = path / "last.ckpt"
        self.patches = path / "patches"
        self.pictures = path / "pictures"
        self.metrics = RowLog(path / "metrics.csv")
        self.steps = RowLog(path / "steps.csv")
        self._result = path / "result.json"
        self._settings = path / "settings.json"
        path.mkdir(parents=True, exist_ok=True)
        self._lock = self._acquire_lock()
        self._check_identity()
        write_atomically(self._settings, json.dumps(settings, indent=2, sort_keys=True))

    @property
    def result(self) -> dict[str, Any] | None:
        """The finished run's result, or None while the run is not finished."""
        if not self._result.exists():
            return None
        try:
            return json.loads(self._result.read_text())
        except ValueError as error:
            raise ValueError(
                f"{self._result} is damaged ({error}); delete it, and the same command evaluates "
                "the run again from its last checkpoint"
            ) from error

    def write_result(self, result: dict[str, Any]) -> None:
        write_atomically(self._result, json.dumps(result, indent=2))

    def close(self) -> None:
        """Writes the logs out and lets other processes use the folder."""
        self.metrics.close()
        self.steps.close()
        self._lock.close()

    def _acquire_lock(self) -> TextIO:
        lock = (self.path / ".lock").open("w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            lock.close()
            raise RuntimeError(
                f"{self.path}: another process is training this run; wait for it or stop it"
            ) from error
        return lock

    def _check_identity(self) -> None:
        if not self._settings.exists():
            return
        earlier = _flatten(json.loads(self._settings.read_text()))
        now = _flatten(self.settings)
        different = [
            f"{key}: {earlier.get(key, 'absent')!r} there, {now.get(key, 'absent')!r} now"
            for key in sorted(earlier.keys() | now.keys())
            if earlier.get(key) != now.get(key)
        ]
        if different:
            self._lock.close()
            raise ValueError(
                f"{self.path} holds another run ({'; '.join(different[:3])}"
                f"{'; …' if len(different) > 3 else ''}); choose another folder with run.folder=…, "
                "or delete that one"
            )


def write_atomically(path: Path, text: str) -> None:
    """Writes a file so that a crash leaves either the old content or the new one."""
    temporary = path.with_name(path.name + ".tmp")
    with temporary.open("w") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    temporary.replace(path)


def _flatten(value: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(value, dict):
        return {prefix: value}
    return {
        key: leaf
        for name, child in value.items()
        for key, leaf in _flatten(child, f"{prefix}.{name}" if prefix else name).items()
    }
