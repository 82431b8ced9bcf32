"""The last two checkpoints of a run: whatever happens to one of them, the run goes on."""

import hashlib
import io
import json
import os
import random
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import torch

from ngi.files.row_log import RowLog
from ngi.learn import RunFolder, prepare_resume
from ngi.learn.checkpoint import AtomicCheckpointIO
from tests.learn.comparison import assert_same_run
from tests.learn.forked import configuration, run

FLIPS = 60
FORGETFUL = ("reuse.store.capacity=12", "budget.steps=47")
"""The older checkpoint needs patches that the newer one has forgotten."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 47 steps with checkpoints of steps 42 and 47."""
    folder = tmp_path_factory.mktemp("finished")
    status, output = run(configuration(folder, *FORGETFUL), folder / "output")
    assert status == 0, output
    assert segments(folder / "run" / "previous.ckpt") - segments(folder / "run" / "last.ckpt")
    return folder


@pytest.fixture
def copy(tmp_path: Path, finished: Path) -> Path:
    """The same, without its result."""
    shutil.copytree(finished / "run", tmp_path / "run")
    (tmp_path / "run" / "result.json").unlink()
    return tmp_path / "run"


def resume(folder: Path) -> int:
    """The step that the run in this folder goes on from."""
    run_folder = RunFolder(folder, settings=json.loads((folder / "settings.json").read_text()))
    try:
        path = prepare_resume(run_folder)
    finally:
        run_folder.close()
    assert path == folder / "last.ckpt"
    return torch.load(path, weights_only=True)["global_step"]


def flip(file: Path, position: int) -> None:
    content = bytearray(file.read_bytes())
    content[position] ^= 1 << position % 8
    file.write_bytes(content)


def segments(checkpoint: Path) -> set[str]:
    """The names of the patch files that a checkpoint needs."""
    state = torch.load(checkpoint, weights_only=True)["ExplorationDataModule"]["store"]
    return {segment["name"] for segment in state["segments"]}


def contents(folder: Path) -> dict[Path, bytes]:
    return {f: f.read_bytes() for f in folder.rglob("*") if f.is_file() and f.name != ".lock"}


def test_a_flipped_bit_anywhere_is_found_and_the_older_one_is_used(copy: Path) -> None:
    whole = {name: (copy / name).read_bytes() for name in ("last.ckpt", "previous.ckpt")}
    size = len(whole["last.ckpt"])
    for position in {0, size - 1, size - 33, *random.Random(3).choices(range(size), k=FLIPS)}:
        for name, content in whole.items():
            (copy / name).write_bytes(content)
        flip(copy / "last.ckpt", position)
        assert resume(copy) == 42, position
        assert (copy / "last.ckpt").read_bytes() == whole["previous.ckpt"]
        assert not (copy / "previous.ckpt").exists()


@pytest.mark.parametrize("damaged", ["checkpoint", "cut checkpoint", "patches", "no patches"])
def test_a_run_with_a_damaged_file_ends_like_a_whole_one(
    tmp_path: Path, copy: Path, finished: Path, damaged: str
) -> None:
    file = copy / "last.ckpt"
    if "patches" in damaged:
        (only_newer,) = segments(file) - segments(copy / "previous.ckpt")
        file = copy / "patches" / only_newer
    if damaged == "no patches":
        file.unlink()
    elif damaged == "cut checkpoint":
        os.truncate(file, 1000)
    else:
        flip(file, file.stat().st_size // 2)
    config = configuration(tmp_path, *FORGETFUL, references=finished / "references")
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    (warning,) = [line for line in output.splitlines() if "using the previous checkpoint" in line]
    assert str(file) in warning
    assert "damaged" in warning or "gone" in warning
    assert "resuming from step 42, the last one saved; later steps are repeated (5" in output
    assert_same_run(copy, finished / "run")


@pytest.mark.parametrize("damaged", ["checkpoints", "patches"])
def test_where_both_are_damaged_nothing_is_touched(copy: Path, damaged: str) -> None:
    if damaged == "patches":
        shared = segments(copy / "last.ckpt") & segments(copy / "previous.ckpt")
        files = [copy / "patches" / min(shared)]
    else:
        files = [copy / "last.ckpt", copy / "previous.ckpt"]
    for file in files:
        flip(file, 5000)
    before = contents(copy)
    with pytest.raises(ValueError, match=r"restore a copy, or delete every checkpoint") as caught:
        resume(copy)
    assert all(f"{file} is damaged" in str(caught.value) for file in files)
    assert contents(copy) == before


def test_a_crash_between_two_renames_leaves_the_older_one(copy: Path) -> None:
    (copy / "last.ckpt").unlink()
    other = json.loads((copy / "settings.json").read_text()) | {"seed": 1}
    with pytest.raises(ValueError, match="seed: 0 there, 1 now"):
        RunFolder(copy, settings=other)
    assert resume(copy) == 42
    assert pd.read_csv(copy / "steps.csv")["step"].iloc[-1] == 42


class Malicious:
    """What happens when it is unpickled."""

    def __init__(self, witness: Path) -> None:
        self._witness = witness

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self._witness),)


def test_a_checkpoint_executes_nothing(tmp_path: Path, copy: Path) -> None:
    witness = tmp_path / "executed"
    buffer = io.BytesIO()
    torch.save({"global_step": 40, "payload": Malicious(witness)}, buffer)
    buffer.write(hashlib.sha256(buffer.getbuffer()).digest())
    (copy / "last.ckpt").write_bytes(buffer.getbuffer())
    (copy / "previous.ckpt").write_bytes(buffer.getbuffer())
    with pytest.raises(ValueError, match=r"last\.ckpt cannot be read \(UnpicklingError\)"):
        resume(copy)
    assert not witness.exists()
    torch.load(copy / "last.ckpt", weights_only=False)
    assert witness.exists(), "it is harmless"


def writer(folder: Path) -> AtomicCheckpointIO:
    return AtomicCheckpointIO(identity="me", previous=folder / "previous.ckpt")


def test_the_last_two_are_kept(tmp_path: Path) -> None:
    for step in range(4):
        writer(tmp_path).save_checkpoint({"global_step": step}, tmp_path / "last.ckpt")
    steps = {p.name: torch.load(p, weights_only=True)["global_step"] for p in tmp_path.iterdir()}
    assert steps == {"last.ckpt": 3, "previous.ckpt": 2}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_leaves_the_old_checkpoints(tmp_path: Path) -> None:
    path = tmp_path / "last.ckpt"
    for step in (1, 2):
        writer(tmp_path).save_checkpoint({"global_step": step}, path)
    before = contents(tmp_path)
    (tmp_path / "last.ckpt.partial").symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"No space left.*Free disk space.*last\.ckpt"):
        writer(tmp_path).save_checkpoint({"global_step": 3}, path)
    assert contents(tmp_path) == before
    assert not (tmp_path / "last.ckpt.partial").is_symlink()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_log_on_a_full_disk_names_itself(tmp_path: Path) -> None:
    (tmp_path / "steps.csv").symlink_to("/dev/full")
    log = RowLog(tmp_path / "steps.csv")
    log.append({"step": 1})
    with pytest.raises(OSError, match=r"No space left.*Free disk space.*steps\.csv"):
        log.flush()
    with pytest.raises(OSError, match=r"Free disk space.*steps\.csv"):
        log.close()
    log.close()  # once reported, it is over
