"""Checkpoints that a crash, a full disk or the wrong run can not turn into lost work."""

import hashlib
import io
import logging
import os
from pathlib import Path
from typing import Any

import torch

from ngi.files.durable import DamagedError, serialised, write_atomically
from ngi.files.run_folder import RunFolder
from ngi.learn.datamodule import ExplorationDataModule
from ngi.learn.lightning_api import TorchCheckpointIO
from ngi.reuse import PatchArchive

log = logging.getLogger(__name__)

IDENTITY = "run_identity"
"""Key under which a checkpoint names the run it belongs to."""

STREAM = ExplorationDataModule.__qualname__
"""Key of the stream's state."""

STEP_GUARD = "step_guard"
"""Key of the guard's state."""

DECAYS_FROM = "decays_from"
"""Key, in the state of `BudgetAndCheckpoint`, of the step after which the learning rate's decay
began; None before."""

OTHER_FOLDER = "choose another folder with run.folder=… for the longer run"

CHECKSUM_BYTES = hashlib.sha256().digest_size
"""A checkpoint file ends with the SHA-256 of what comes before; torch.load does not mind."""


class AtomicCheckpointIO(TorchCheckpointIO):
    """Writes beside the old checkpoint, and replaces it only once the new one is on the disk.

    identity: the run's identity, written into the checkpoint; `prepare_resume` asks for it.
    previous: where the replaced checkpoint is kept, in case the new one is damaged later
    """

    def __init__(self, *, identity: str, previous: Path) -> None:
        super().__init__()
        self._identity = identity
        self._previous = previous

    def save_checkpoint(
        self,
        checkpoint: dict[str, Any],
        path: str | os.PathLike[str],
        storage_options: Any | None = None,  # noqa: ARG002
    ) -> None:
        """Raises OSError with what to do where the disk is full; the old checkpoints stay."""
        content = {**checkpoint, IDENTITY: self._identity}
        with checkpoint_bytes(content) as view:  # let go of as in `write_tensors`
            write_atomically(Path(path), view, keep_old_as=self._previous)


def prepare_resume(folder: RunFolder) -> Path | None:
    """The checkpoint to go on from, or None for a fresh start; cuts the logs back to it.

    Where the newest one, or a patch that it needs, is damaged, it is replaced by the one before it.
    A run that is trained longer goes on from the last one before its learning rate decayed.
    Raises ValueError where both are damaged, where one belongs to another run, and where a run can
    not be trained longer; the folder is left as it was then.
    """
    if folder.restarted:
        return None
    checkpoint = _newest_usable(folder)
    if checkpoint is None and folder.lengthened:
        raise ValueError(
            f"{folder.path} cannot be trained longer: there is no checkpoint in it; restore "
            f"{folder.checkpoint.name} from a copy, or {OTHER_FOLDER}"
        )
    if checkpoint is None:
        folder.forget_logs()
        return None
    if folder.lengthened:
        checkpoint = _before_decay(folder, checkpoint)
        folder.forget_result()
    step = checkpoint["global_step"]
    dropped = {log_file: log_file.keep_until(step) for log_file in folder.logs}
    log.info(
        "%s: resuming from step %d, the last one saved; later steps are repeated (%d are in "
        "steps.csv; a killed run may have done more)",
        folder.path,
        step,
        dropped[folder.steps],
    )
    return folder.checkpoint


def _newest_usable(folder: RunFolder) -> dict[str, Any] | None:
    """What `folder.checkpoint` holds once it is one that can be used; None where there is none."""
    problems = []
    for path in (folder.checkpoint, folder.previous_checkpoint):
        if not path.exists():
            continue
        try:
            checkpoint = _read(path, folder)
        except DamagedError as error:
            problems.append(str(error))
            continue
        for problem in problems:
            log.warning("%s; using the previous checkpoint", problem)
        os.replace(path, folder.checkpoint)
        return checkpoint
    if problems:
        afresh = (
            f"delete every checkpoint (*.ckpt) in {folder.path}, and the same command starts the "
            "run again from step 0"
        )
        remedy = OTHER_FOLDER if folder.lengthened else afresh
        raise ValueError(f"{'; '.join(problems)}; restore a copy, or {remedy}")
    return None


def _before_decay(folder: RunFolder, newest: dict[str, Any]) -> dict[str, Any]:
    """What `folder.checkpoint` holds once a longer run can go on from it."""
    step = newest["callbacks"]["BudgetAndCheckpoint"][DECAYS_FROM]
    log.info("%s is trained longer; its result will be replaced", folder.path)
    if step is None:
        return newest
    if step == newest["global_step"]:  # as a start leaves it that is killed below
        folder.previous_checkpoint.unlink(missing_ok=True)
        return newest
    if step == 0:
        raise ValueError(
            f"{folder.path} cannot be trained longer: its learning rate decays from the first "
            "step on (schedule.decay_share: 1), so a longer run differs in every step; "
            f"{OTHER_FOLDER}"
        )
    path = folder.stable_checkpoint
    try:
        stable = _read(path, folder)
    except (OSError, DamagedError) as error:
        raise ValueError(
            f"{folder.path} cannot be trained longer: its learning rate has decayed since step "
            f"{step}, and the checkpoint of that step is unusable ({error}); "
            f"{OTHER_FOLDER}"
        ) from error
    folder.forget_result()
    write_atomically(folder.checkpoint, path.read_bytes())
    folder.previous_checkpoint.unlink(missing_ok=True)  # it may have decayed, too
    return stable


def checkpoint_bytes(content: dict[str, Any]) -> memoryview:
    """Of a file that `read_checkpoint` reads."""
    buffer = serialised(content)
    buffer.write(hashlib.sha256(buffer.getbuffer()).digest())
    return buffer.getbuffer()


def read_checkpoint(path: Path) -> dict[str, Any]:
    """A checkpoint file's content, on the CPU; executes no code of it.

    Raises `DamagedError` where it is not what was written.
    """
    content = memoryview(path.read_bytes())
    content, checksum = content[:-CHECKSUM_BYTES], content[-CHECKSUM_BYTES:]
    if hashlib.sha256(content).digest() != checksum:
        raise DamagedError(f"{path} is damaged (its checksum does not match its content)")
    try:
        checkpoint: dict[str, Any] = torch.load(
            io.BytesIO(content), map_location="cpu", weights_only=True
        )
    except Exception as error:  # torch.load raises nearly anything; its advice is to execute code
        raise DamagedError(f"{path} cannot be read ({type(error).__name__})") from error
    return checkpoint


def _read(path: Path, folder: RunFolder) -> dict[str, Any]:
    checkpoint = read_checkpoint(path)
    if checkpoint[IDENTITY] != folder.identity:
        raise ValueError(
            f"{path} belongs to run {checkpoint[IDENTITY]}, this is run {folder.identity} (another "
            "scene or configuration); choose another folder with run.folder=…, or delete the "
            "checkpoint"
        )
    PatchArchive(folder.patches).check(checkpoint[STREAM]["store"])
    return checkpoint
