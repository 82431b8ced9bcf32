"""A full disk stops a run with an error that names the file; given room, it goes on.

The disk is really full: a small tmpfs where this process may mount one, a limit to the size of
files where it may not, and /dev/full behind the name of a single file.
"""

import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from ngi.files.growing_file import GrowingFile
from ngi.files.record_log import RecordLog
from ngi.files.row_log import RowLog
from tests.learn.comparison import assert_same_run
from tests.learn.forked import configuration, run

FULL = Path("/dev/full")
DISK = 2**23


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken")
    status, output = run(configuration(folder), folder / "output")
    assert status == 0, output
    return folder


def assert_stopped(status: int, output: str, file: str) -> None:
    assert status == 1, output
    errors = [line for line in output.splitlines() if line.startswith("OSError")]
    assert file in errors[-1]
    assert "Free disk space" in errors[-1]


def onto_full_device(log: type[GrowingFile], name: str) -> None:
    """Lets what is appended to the log of that name go to a device that is full."""
    original = log._open

    def redirected(self: Any, *arguments: Any) -> None:
        original(self, *arguments)
        if self.path.name == name:
            os.dup2(os.open(FULL, os.O_WRONLY), self._stream.fileno())

    log._open = redirected


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize(
    ("log", "file"), [(RowLog, "steps.csv"), (RowLog, "metrics.csv"), (RecordLog, "chains.bin")]
)
def test_each_log_names_itself(
    tmp_path: Path, unbroken: Path, log: type[GrowingFile], file: str
) -> None:
    config = configuration(tmp_path, references=unbroken / "references")
    first = partial(onto_full_device, log, file)
    status, output = run(config, tmp_path / "output", first=first)
    assert_stopped(status, output, str(tmp_path / "run" / file))
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert_same_run(tmp_path / "run", unbroken / "run")


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize(
    ("file", "written"),
    [
        ("settings.json", "settings.json.partial"),
        ("last.ckpt", "last.ckpt.partial"),
        ("patches/patches-000000000000-000000000024.pt", None),
        ("pictures", "pictures/hard_00_prediction.png"),
        ("result.json", "result.json.partial"),
    ],
)
def test_each_file_names_itself(
    tmp_path: Path, unbroken: Path, file: str, written: str | None
) -> None:
    link = tmp_path / "run" / (written or f"{file}.partial")
    link.parent.mkdir(parents=True)
    link.symlink_to(FULL)
    config = configuration(tmp_path, references=unbroken / "references")
    status, output = run(config, tmp_path / "output")
    assert_stopped(status, output, str(tmp_path / "run" / file))
    link.unlink(missing_ok=True)
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert_same_run(tmp_path / "run", unbroken / "run")


def small_disk(folder: Path, stack: ExitStack) -> bool:
    """Mounts a disk of `DISK` bytes on the folder until the stack is closed, if that is allowed."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "none", str(folder)]
    try:
        allowed = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False
    if allowed:
        stack.callback(subprocess.run, ["umount", str(folder)], check=True)
    return allowed


@pytest.fixture(params=[100, 400, 700, 1000])
def nearly_full(
    request: pytest.FixtureRequest, tmp_path: Path
) -> Iterator[tuple[Path, Callable[[], object] | None, Callable[[], None]]]:
    """A folder with so many KB left; what has to be called in a process; what makes room again."""
    folder, left = tmp_path / "disk", request.param * 1024
    with ExitStack() as stack:
        if small_disk(folder, stack):
            filler = folder / "filler"
            filler.write_bytes(bytes(DISK - left))
            yield folder, None, filler.unlink
        else:
            limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (left // 5, left // 5))
            yield folder, limit, lambda: None


def test_a_disk_that_fills_up_loses_nothing(
    nearly_full: tuple[Path, Callable[[], object] | None, Callable[[], None]],
    tmp_path: Path,
    unbroken: Path,
) -> None:
    folder, limit, make_room = nearly_full
    config = configuration(folder, references=unbroken / "references")
    status, output = run(config, tmp_path / "output", first=limit)
    assert_stopped(status, output, str(folder))
    assert not [*folder.rglob("*.partial")]
    make_room()
    status, output = run(config, tmp_path / "output")
    assert status == 0, output
    assert_same_run(folder / "run", unbroken / "run")


def test_references_that_do_not_fit_name_themselves(tmp_path: Path, unbroken: Path) -> None:
    full = tmp_path / "references"
    with ExitStack() as stack:
        first = None
        if small_disk(full, stack):
            (full / "filler").write_bytes(bytes(DISK - 50 * 1024))
        else:
            first = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (10_000, 10_000))
        config = configuration(tmp_path)
        status, output = run(config, tmp_path / "output", first=first)
        assert_stopped(status, output, str(full))
        assert not [*full.rglob("*.partial")]
        (full / "filler").unlink(missing_ok=True)
        status, output = run(config, tmp_path / "output")
        assert status == 0, output
        assert_same_run(tmp_path / "run", unbroken / "run")
        assert len([*full.iterdir()]) == len(os.listdir(unbroken / "references"))
