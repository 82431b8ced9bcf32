"""Files that are whole or not there: what is left behind where one can not be written."""

import errno
import os
import traceback
from pathlib import Path

import pytest
import torch

from ngi.files.durable import write_tensors


def test_an_error_holds_no_view_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python 3.12.1 crashes at a later garbage collection that finds one."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="Free disk space") as caught:
        write_tensors(tmp_path / "tensors.pt", {"a": torch.zeros(3)})
    frames = [frame for frame, _ in traceback.walk_tb(caught.tb)]
    views = [v for f in frames for v in f.f_locals.values() if isinstance(v, memoryview)]
    assert views
    for view in views:
        with pytest.raises(ValueError, match="released memoryview"):
            view.tobytes()
