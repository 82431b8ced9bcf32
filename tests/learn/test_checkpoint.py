import errno
import os
from pathlib import Path

import pytest
import torch

from ngi.learn.checkpoint import AtomicCheckpointIO
from ngi.learn.row_log import RowLog


def test_a_full_disk_leaves_the_old_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "last.ckpt"
    writer = AtomicCheckpointIO(identity="me")
    writer.save_checkpoint({"global_step": 1}, path)

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left.*Make room.*last\.ckpt"):
        writer.save_checkpoint({"global_step": 2}, path)
    assert torch.load(path, weights_only=True)["global_step"] == 1
    assert [p.name for p in tmp_path.iterdir()] == ["last.ckpt"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_log_on_a_full_disk_names_itself(tmp_path: Path) -> None:
    (tmp_path / "steps.csv").symlink_to("/dev/full")
    log = RowLog(tmp_path / "steps.csv")
    log.append({"step": 1})
    with pytest.raises(OSError, match=r"No space left.*Make room.*steps\.csv"):
        log.flush()
    with pytest.raises(OSError, match=r"Make room.*steps\.csv"):
        log.close()
    log.close()  # once reported, it is over
