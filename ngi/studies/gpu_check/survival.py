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
        status = _status(command())
        if status >= 0 or -status in ASKED_FOR or _contents(progress) == before:
            return status
        name = signal.Signals(-status).name
        print(f"{name} ended the process; going on in another one", flush=True)


def _status(command: Sequence[str]) -> int:
    """Of a process that no signal leaves behind: it gets SIGTERM, too, as Ctrl-C.

    A terminal's Ctrl-C reaches both; this one waits until the other has noted what it had begun.
    """
    # Handled before it begins: what is ignored here, as Ctrl-C is of commands in the background,
    # would be ignored there, too.
    former = {signal.SIGINT: signal.signal(signal.SIGINT, lambda *_: None)}
    try:
        process = subprocess.Popen(command)
        former[signal.SIGTERM] = signal.signal(
            signal.SIGTERM, lambda *_: process.send_signal(signal.SIGINT)
        )
        return process.wait()
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def _contents(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("gpu-check.json")}
