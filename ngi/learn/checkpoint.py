"""Checkpoints that a crash, a full disk or the wrong run can not turn into lost work."""

from __future__ import annotations

import io
import logging
import os
from pathlib import Path
from typing import Any

import torch

from ngi.durable import write_atomically
from ngi.learn.lightning_api import TorchCheckpointIO
from ngi.learn.run_folder import RunFolder

log = logging.getLogger(__name__)

IDENTITY = "run_identity"
"""Key under which a checkpoint names the run it belongs to."""


class AtomicCheckpointIO(TorchCheckpointIO):
    """Writes beside the old checkpoint, and replaces it only once the new one is on the disk.

    identity: the run's identity, written into the checkpoint; `prepare_resume` asks for it.
    """

    def __init__(self, *, identity: str) -> None:
        super().__init__()
        self._identity = identity

    def save_checkpoint(
        self,
        checkpoint: dict[str, Any],
        path: str | os.PathLike[str],
        storage_options: Any | None = None,  # noqa: ARG002
    ) -> None:
        """Raises OSError with what to do where the disk is full; the old checkpoint stays."""
        content = {**checkpoint, IDENTITY: self._identity}
        # torch.save hides the OSError of a full disk behind an internal RuntimeError: go by memory.
        buffer = io.BytesIO()
        torch.save(content, buffer)
        write_atomically(Path(path), buffer.getbuffer())


def prepare_resume(folder: RunFolder) -> Path | None:
    """The checkpoint to go on from, or None for a fresh start; cuts the logs back to it.

    Raises ValueError where it is damaged or belongs to another run.
    """
    path = folder.checkpoint
    step = 0
    if path.exists():
        checkpoint = _read(path, identity=folder.identity)
        step = checkpoint["global_step"]
        log.info("%s: going on from step %d", folder.path, step)
    for log_file in folder.logs:
        log_file.keep_until(step)
    return path if path.exists() else None


def _read(path: Path, *, identity: str) -> dict[str, Any]:
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        raise ValueError(
            f"{path} is damaged ({type(error).__name__}: {error}); put back a copy, or delete it "
            "and the same command starts the run afresh"
        ) from error
    if not isinstance(checkpoint, dict) or IDENTITY not in checkpoint:
        raise ValueError(f"{path} is no checkpoint of this program; remove it from the folder")
    if checkpoint[IDENTITY] != identity:
        raise ValueError(
            f"{path} belongs to run {checkpoint[IDENTITY]}, this is run {identity} (another scene "
            "or configuration); choose another folder with run.folder=…, or delete the checkpoint"
        )
    return checkpoint
