"""Begins a command again where a fault of a library has ended its process."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

ASKED_FOR = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
"""Signals that somebody sends, not a fault."""


def surviving(command: Callable[[], Sequence[str]], *, progress: Path) -> int:
    """Its exit status, or minus the signal's number.

    command: the words of the next process.
    progress: folder whose JSON files change before anything that may crash. Where they have not,
        the next process would come no further, and there is none.
    """
    while True:
        before = _contents(progress)
        status = subprocess.run(command(), check=False).returncode
        if status >= 0 or -status in ASKED_FOR or _contents(progress) == before:
            return status
        name = signal.Signals(-status).name
        print(f"{name} ended the process; going on in another one", flush=True)


def _contents(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("gpu-check.json")}
