"""A run whose program has changed goes on with a warning, is refused, or begins afresh."""

import logging
import shutil
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from omegaconf import DictConfig

from ngi.files.code_versions import record_code_version
from ngi.learn.code_change import heed_code_change
from ngi.train import train
from tests.files.test_code_versions import program_is
from tests.learn.command_line import SMALL
from tests.learn.comparison import assert_same, final_state
from tests.learn.composition import run_config
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED, RESUMED

pytestmark = [*IGNORED, RESUMED]


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch):
    return partial(program_is, monkeypatch)


def trained(folder: Path, on_change: str, *, steps: int = 20) -> DictConfig:
    config = configuration(folder, references=folder.parent / "references")
    config.budget.steps, config.run.on_code_change = steps, on_change
    return config


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that another version of the program made."""
    folder = tmp_path_factory.mktemp("code") / "finished"
    with pytest.MonkeyPatch.context() as patch:
        program_is(patch, "a", "1")
        train(trained(folder, "continue"))
    return folder


@pytest.fixture
def copy(tmp_path: Path, finished: Path, program) -> Path:
    folder = finished.parent / tmp_path.name
    shutil.copytree(finished, folder)
    program("b", "2")
    return folder


def contents(folder: Path) -> dict[Path, bytes]:
    return {f: f.read_bytes() for f in folder.rglob("*") if f.is_file() and f.name != ".lock"}


def test_a_finished_run_of_changed_code_stays_and_that_is_said(copy: Path, caplog) -> None:
    before = contents(copy)
    train(trained(copy, "continue"))
    assert contents(copy) == before
    (warning,) = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert "was made with commit aaaaaaaaaaaa; this program is commit bbbbbbbbbbbb" in warning
    assert "to repeat the run, set run.on_code_change=restart" in warning


def test_the_same_code_is_not_worth_a_word(copy: Path, caplog, program) -> None:
    program("a", "1")
    before = contents(copy)
    train(trained(copy, "refuse"))
    assert contents(copy) == before
    assert [r for r in caplog.records if r.levelno == logging.WARNING] == []


@pytest.mark.parametrize("state", ["finished", "interrupted"])
def test_changed_code_can_be_refused(copy: Path, state: str) -> None:
    if state == "interrupted":
        (copy / "run" / "result.json").unlink()
    before = contents(copy)
    with pytest.raises(RuntimeError, match=r"run: .*=restart deletes it|made with commit a"):
        train(trained(copy, "refuse"))
    assert contents(copy) == before


def test_a_version_that_was_only_started_is_not_what_a_run_was_made_with(copy: Path) -> None:
    (copy / "run" / "result.json").unlink()
    record_code_version(copy / "run", after_step=20)
    with pytest.raises(RuntimeError, match=r"was made with commit aaaaaaaaaaaa"):
        train(trained(copy, "refuse"))


@pytest.mark.parametrize("state", ["finished", "interrupted"])
def test_restarted_it_is_the_run_of_the_new_code_alone(copy: Path, state: str, caplog) -> None:
    if state == "interrupted":
        (copy / "run" / "result.json").unlink()
    unbroken = copy.parent / f"{copy.name}-unbroken"
    train(trained(unbroken, "continue"))
    result = train(trained(copy, "restart"))
    assert "the run is deleted and begins again" in caplog.text
    assert [v["commit"][0] for v in result["commits"]] == ["b"]
    assert_same(final_state(copy / "run"), final_state(unbroken / "run"))
    assert (copy / "run" / "chains.bin").read_bytes() == (
        unbroken / "run" / "chains.bin"
    ).read_bytes()


def test_a_restart_that_cannot_be_built_deletes_nothing(copy: Path) -> None:
    before = contents(copy)
    config = trained(copy, "restart")
    config.evaluation.count = 3
    config.run.checkpoint_steps = 7
    config.run.lpips_weights = None
    config.evaluation.evaluator.lpips.weights = str(copy / "nowhere.pth")
    with pytest.raises(Exception, match=r"nowhere\.pth"):
        train(config)
    assert contents(copy) == before


def test_an_interrupted_run_goes_on_with_a_warning(copy: Path, caplog) -> None:
    (copy / "run" / "result.json").unlink()
    result = train(trained(copy, "continue"))
    assert [v["commit"][0] for v in result["commits"]] == ["a", "b"]
    assert "resumes with commit bbbbbbbbbbbb; up to step 20" in caplog.text


def test_another_word_is_refused() -> None:
    with pytest.raises(ValueError, match=r"run\.on_code_change: 'maybe'; expected one of"):
        heed_code_change(SimpleNamespace(), on_change="maybe")  # type: ignore[arg-type]


def test_path_traced_runs_heed_it_too(tmp_path: Path, caplog, program) -> None:
    places = (f"run.folder={tmp_path / 'run'}", f"run.references={tmp_path / 'references'}")
    config = run_config(*SMALL, "+renderer.noise=1.0", "method=path_tracing_8spp", *places)
    program("a", "1")
    assert train(config)["commits"][0]["commit"] == "a" * 40
    program("b", "2")
    assert train(config)["commits"][0]["commit"] == "a" * 40
    assert "is commit bbbbbbbbbbbb: to repeat the run, set run.on_code_change=" in caplog.text
    config.run.on_code_change = "restart"
    assert [version["commit"] for version in train(config)["commits"]] == ["b" * 40]
