"""Checkpoints that a crash, a full disk or the wrong run can not turn into lost work."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

import torch

from ngi.learn.lightning_api import TorchCheckpointIO
from ngi.learn.run_folder import RunFolder

log = logging.getLogger(__name__)

IDENTITY = "run_identity"
"""Key under which a checkpoint names the run it belongs to."""


class AtomicCheckpointIO(TorchCheckpointIO):
    """Writes beside the old checkpoint, and replaces it only once the new one is on the disk.

    identity: the run's identity, written into the checkpoint and asked for when it is read.
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
        target = Path(path)
        temporary = target.with_name(target.name + ".tmp")
        try:
            with temporary.open("wb") as stream:
                torch.save({**checkpoint, IDENTITY: self._identity}, stream)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(target)
        except (OSError, RuntimeError) as error:  # torch.save reports a full disk as RuntimeError
            temporary.unlink(missing_ok=True)
            raise OSError(
                f"{target}: the checkpoint could not be written ({error}); earlier results are "
                "intact. Make room, and the same command goes on from the last checkpoint"
            ) from error


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
    folder.metrics.keep_until(step)
    folder.steps.keep_until(step)
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
