"""`ngi view` where there is nothing to see."""

import sys
from pathlib import Path

import pytest

from ngi.view.__main__ import main
from tests.learn.command_line import run


def test_a_run_that_is_not_there_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser", reason="needs pip install -e .[viewer]")
    assert main([f"run={tmp_path / 'typo'}"]) == 2
    assert f"{tmp_path / 'typo'}" in capsys.readouterr().err


def test_a_damaged_checkpoint_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("viser", reason="needs pip install -e .[viewer]")
    status, output = run(tmp_path, "run.folder=run")
    assert status == 0, output
    for checkpoint in (tmp_path / "run").glob("*.ckpt"):
        checkpoint.write_bytes(checkpoint.read_bytes()[:-100])
    assert main([f"run={tmp_path / 'run'}", "port=0"]) == 2
    assert "is damaged" in capsys.readouterr().err


def test_what_has_to_be_installed_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "ngi.view.page", raising=False)
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["run=any"]) == 2
    assert "ngi view needs viser: pip install -e .[viewer]" in capsys.readouterr().err
