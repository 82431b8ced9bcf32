"""A process that a fault of a library ends is followed by another one, as long as that helps."""

import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ngi.studies.gpu_check import __main__ as gpu_check
from ngi.studies.gpu_check.survival import surviving

CODE = """
import os, sys
from pathlib import Path
file, ends, writes = Path(sys.argv[1]) / "card" / "gpu-check.json", *map(int, sys.argv[2:])
file.parent.mkdir(exist_ok=True)
begun = len(file.read_text()) if file.exists() else 0
if writes:
    file.write_text("x" * (begun + 1))
if begun < 3:
    os.kill(os.getpid(), ends)
raise SystemExit(7)
"""


def ended(folder: Path, by: int, *, writes: bool = True) -> tuple[int, int]:
    """Status, and how many processes there were; each of the first three is ended."""
    begun = []

    def command() -> list[str]:
        begun.append(time.monotonic())
        return [sys.executable, "-c", CODE, str(folder), str(int(by)), str(int(writes))]

    return surviving(command, progress=folder), len(begun)


def test_after_a_fault_another_process_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended(tmp_path, signal.SIGABRT) == (7, 4)
    assert capsys.readouterr().out.count("SIGABRT ended the process") == 3


def test_a_fault_before_anything_is_begun_is_not_met_for_ever(tmp_path: Path) -> None:
    assert ended(tmp_path, signal.SIGSEGV, writes=False) == (-signal.SIGSEGV, 1)


@pytest.mark.parametrize("asked", [signal.SIGTERM, signal.SIGKILL])
def test_who_ends_the_process_ends_the_command(tmp_path: Path, asked: signal.Signals) -> None:
    assert ended(tmp_path, asked) == (-asked, 1)


@pytest.fixture(params=["foreground", "background"])
def ctrl_c(request: pytest.FixtureRequest) -> Iterator[Any]:
    """What Python does at Ctrl-C, and what it does of a command that a shell began with '&'."""
    wanted = {"foreground": signal.default_int_handler, "background": signal.SIG_IGN}[request.param]
    former = signal.signal(signal.SIGINT, wanted)
    yield wanted
    signal.signal(signal.SIGINT, former)


@pytest.mark.parametrize("asked", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_to_the_command_leaves_no_process_behind(
    tmp_path: Path, asked: signal.Signals, ctrl_c: Any
) -> None:
    """The other process gets SIGTERM as Ctrl-C; Ctrl-C it has from the terminal."""
    code = """
import os, signal, sys, time
from pathlib import Path
try:
    Path(sys.argv[1], "begun").touch()
    os.kill(os.getppid(), int(sys.argv[2]))
    time.sleep(2 if int(sys.argv[2]) == signal.SIGINT else 60)
except KeyboardInterrupt:
    raise SystemExit(130)
raise SystemExit(5)
"""
    command = [sys.executable, "-c", code, str(tmp_path), str(int(asked))]
    status = surviving(lambda: command, progress=tmp_path)
    assert status == (130 if asked is signal.SIGTERM else 5)
    assert (tmp_path / "begun").exists()
    assert signal.getsignal(signal.SIGINT) is ctrl_c
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_the_next_process_has_the_time_that_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left: list[float] = []

    def crash_twice(words: list[str]) -> int:
        assert words[3:-1] == ["--minutes", "2", "--output", str(tmp_path)]
        left.append(float(words[-1].removeprefix("--minutes=")))
        (tmp_path / "gpu-check.json").write_text("x" * len(left))
        clock[0] += 30
        return -signal.SIGABRT if len(left) < 3 else 3

    clock = [100.0]
    monkeypatch.setattr(gpu_check.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr("ngi.studies.gpu_check.survival._status", crash_twice)
    assert gpu_check.main(["--minutes", "2", "--output", str(tmp_path)]) == 3
    assert left == pytest.approx([2, 1.5, 1])


@pytest.mark.parametrize("option", ["--minutes", "--training-minutes"])
@pytest.mark.parametrize("minutes", ["-3", "0", "nan"])
def test_no_time_at_all_is_refused(
    option: str, minutes: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        gpu_check.main([f"{option}={minutes}", "--output", str(tmp_path)])
    assert ended.value.code == 2
    assert f"{option}: {minutes}: give more than 0" in capsys.readouterr().err
