"""A run that cannot start gives back what it has taken: other jobs of a sweep need it."""

import json
import socket
from pathlib import Path

import pytest
from hydra.errors import InstantiationException

from ngi import learn
from ngi.learn.saving import BudgetAndCheckpoint
from ngi.train import train
from tests.learn.command_line import SMALL
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NGI_CACHE", str(tmp_path / "cache"))


def test_the_folder_is_free_where_the_tracker_fails() -> None:
    config = run_config(*SMALL[1:], "tracker=wandb", "tracker.mode=maybe")
    with pytest.raises(InstantiationException, match=r"tracker\.mode") as error:
        train(config)
    learn.RunFolder(Path("run"), settings={}).close()
    assert error.value.__traceback__ is not None  # holds what was made alive


def test_the_port_is_free_where_the_start_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser", reason="needs pip install -e .[viewer]")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]

    def fail(_: learn.RunFolder) -> None:
        with socket.socket() as other, pytest.raises(OSError, match="in use"):
            other.bind(("127.0.0.1", port))
        raise RuntimeError("the disk is gone")

    monkeypatch.setattr(learn, "prepare_resume", fail)
    config = run_config(*SMALL[1:], "viewer=true", f"run.viewer_port={port}")
    with pytest.raises(RuntimeError, match="the disk is gone"):
        train(config)
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(("127.0.0.1", port))


def test_what_a_run_that_was_never_saved_left_is_no_part_of_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Out of memory in the first minute, and begun again with fewer chains."""

    def full(*_: object) -> None:
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr(BudgetAndCheckpoint, "_save", full)
        with pytest.raises(MemoryError):
            train(run_config(*SMALL, "sampler=mcmc_loss", "sampler.chains=8"))
    assert Path("run/chains.bin").stat().st_size > 0
    train(run_config(*SMALL, "sampler=mcmc_loss", "sampler.chains=4"))
    header = json.loads(Path("run/chains.bin").read_bytes().partition(b"\n")[0])
    assert ["accepted", "|b1", [4]] in header["fields"]
