"""`ngi view` where there is nothing to see, and what it tells the page."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest

from ngi.files.extras import install_command
from ngi.render import AnalyticRenderer
from ngi.view.__main__ import main
from ngi.view.subject import Subject
from ngi.view.trained_run import TrainedRun
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
    assert f"ngi view needs viser: {install_command('viewer')}" in capsys.readouterr().err


@pytest.mark.parametrize("supersampled", [True, False])
def test_the_page_knows_how_edges_are_shown(
    monkeypatch: pytest.MonkeyPatch, supersampled: bool
) -> None:
    pytest.importorskip("viser", reason="needs pip install -e .[viewer]")
    shown: list[Subject] = []

    def page(_: object, subject: Subject, **__: object) -> NoReturn:
        shown.append(subject)
        raise KeyboardInterrupt

    opened: Any = SimpleNamespace(
        folder=Path("outputs/method=ours/seed=0"),
        scene_name="plane",
        step=0,
        description=None,
        renderer=AnalyticRenderer(dimensions=2, patch_size=16),
        predict=None,
        protocol=None,
    )
    monkeypatch.setattr(TrainedRun, "open", lambda *_, **__: opened)
    monkeypatch.setattr("ngi.view.page.Page", page)
    assert main(["run=run", f"supersampled_edges={supersampled}"]) == 130
    assert [each.supersampled_edges for each in shown] == [supersampled]
    assert shown[0].name == "plane, step 0 (method=ours/seed=0)"
