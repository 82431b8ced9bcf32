"""Weights & Biases may raise, hang or be missing: the run does not notice, and its log says so."""

from __future__ import annotations

import logging
import re
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from ngi.learn import WeightsAndBiases, aside, tracker
from tests.render.odd_renderer import wait_for

LABEL = {"experiment": "e", "scene": "s", "sampler": "m", "seed": 0}


class FakeWandb:
    """wandb, as far as it is used; `trouble` is called with what is called: init, log, finish."""

    def __init__(self, trouble=lambda _: None) -> None:
        self._trouble = trouble
        self.rows: list[dict] = []
        self.calls: list[str] = []
        self.Settings = SimpleNamespace

    def init(self, **_):
        self._called("init")
        return self

    def log(self, row, *, step) -> None:
        self._called("log")
        self.rows.append({**row, "step": step})

    def finish(self, *, exit_code) -> None:
        self._called(f"finish {exit_code}")

    def _called(self, what: str) -> None:
        self.calls.append(what)
        self._trouble(what.split()[0])


@pytest.fixture
def watch(monkeypatch, tmp_path):
    """Starts a tracker on a fake wandb."""

    def start(trouble=lambda _: None):
        wandb = FakeWandb(trouble)
        monkeypatch.setitem(sys.modules, "wandb", wandb)
        watched = WeightsAndBiases(project="p", mode="online")
        watched.start(folder=tmp_path, settings={}, label=LABEL)
        return wandb, watched

    return start


def test_rows_arrive_in_order_without_what_is_empty(watch, caplog) -> None:
    wandb, watched = watch()
    for step in range(100):
        watched.log({"step": step, "loss": None if step % 2 else 0.5})
    watched.finish(failed=True)
    watched.finish(failed=True)  # whatever happens
    assert [row["step"] for row in wandb.rows] == list(range(100))
    assert ("loss" in wandb.rows[0], "loss" in wandb.rows[1]) == (True, False)
    assert wandb.calls[-1] == "finish 1"
    assert not caplog.records


def test_a_row_is_logged_as_it_was(watch) -> None:
    gate = threading.Event()
    wandb, watched = watch(lambda _: gate.wait(60))
    row = {"step": 1, "loss": 0.5}
    watched.log(row)
    row["step"] = 2
    gate.set()
    watched.finish(failed=False)
    assert wandb.rows == [{"step": 1, "loss": 0.5}]


@pytest.mark.parametrize("where", ["init", "log", "finish"])
@pytest.mark.parametrize("error", [OSError("No space left on device"), SystemExit(1)])
def test_what_fails_is_said_once(watch, caplog, tmp_path: Path, where, error) -> None:
    def trouble(what):
        if what == where:
            raise error

    wandb, watched = watch(trouble)
    for step in range(5):
        watched.log({"step": step})
    watched.finish(failed=False)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert f"Weights & Biases failed ({type(error).__name__}: {error})" in record.message
    assert f"rows are missing there, but all are in the files of {tmp_path}" in record.message
    assert wandb.calls[-1].split()[0] == where, "nothing is called after that"
    assert [call.split()[0] for call in wandb.calls].count(where) == 1


def test_what_hangs_holds_nothing_up(watch, caplog, monkeypatch) -> None:
    monkeypatch.setattr(tracker, "FINISH_SECONDS", 0.1)
    monkeypatch.setattr(tracker, "LEEWAY_SECONDS", 0.1)
    monkeypatch.setattr(aside, "CAPACITY", 50)
    gate = threading.Event()
    wandb, watched = watch(lambda what: gate.wait(60) if what == "log" else None)
    begun = time.monotonic()
    for step in range(2000):
        watched.log({"step": step})
    logged = time.monotonic()
    watched.finish(failed=False)
    ended = time.monotonic()
    gate.set()
    assert logged - begun < 2
    assert ended - logged < 5
    said = caplog.text
    assert "takes no more calls, 50 of them wait" in said
    assert "is left behind" in said
    lost = re.search(r"has lost (\d+) calls", said)
    assert lost is not None
    assert 1940 <= int(lost[1]) <= 1960
    assert len(caplog.records) == 3
    assert wandb.rows == [] or len(wandb.rows) <= 52


def test_rows_go_on_where_the_network_comes_back(watch, caplog) -> None:
    gate = threading.Event()
    wandb, watched = watch(lambda what: gate.wait(60) if what == "init" else None)
    for step in range(50):
        watched.log({"step": step})
    assert wandb.rows == []
    gate.set()
    watched.finish(failed=False)
    assert len(wandb.rows) == 50
    assert not caplog.records


def test_without_wandb_the_run_does_not_start(monkeypatch, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)  # as if it were not installed
    watched = WeightsAndBiases(project="p", mode="offline")
    with pytest.raises(RuntimeError, match=r"tracker=wandb: .* choose tracker=local"):
        watched.start(folder=tmp_path, settings={}, label=LABEL)
    watched.finish(failed=True)


def test_the_real_one_runs_offline(tmp_path, caplog) -> None:
    watched = WeightsAndBiases(project="p", mode="offline")
    watched.start(folder=tmp_path, settings={"a": 1}, label=LABEL)
    for step in range(3):
        watched.log({"step": step, "loss": 0.5})
    watched.finish(failed=False)
    assert not [record for record in caplog.records if "Weights" in record.message]
    (file,) = tmp_path.rglob("*.wandb")
    wait_for(lambda: file.stat().st_size > 500)  # its service writes it in a process of its own
