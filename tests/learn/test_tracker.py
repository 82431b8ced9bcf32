"""Trackers may raise, hang or be missing: the run does not notice, and its log says so."""

from __future__ import annotations

import logging
import math
import re
import signal
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest

from ngi.learn import Interrupted, MLflow, TensorBoard, WeightsAndBiases, lightning_trackers
from ngi.learn import remote_tracker as remote

LABEL = {
    "scene": "s",
    "method": None,
    "sampler": "m",
    "budget": "b",
    "overrides": "default",
    "seed": 0,
}
SETTINGS = {"budget": {"clock": "wall"}}


class FakeArtifact:
    def __init__(self, name: str, *, type: str) -> None:
        pass


class FakeWandb:
    """wandb, as far as it is used; `trouble` is called with what is called: init, log, finish."""

    def __init__(self, trouble=lambda _: None) -> None:
        self._trouble = trouble
        self.rows: list[dict] = []
        self.calls: list[str] = []
        self.Settings = SimpleNamespace
        self.define_metric = lambda *_, **__: None
        self.id = "abc"
        self.Artifact = FakeArtifact
        self.log_artifact = lambda _: None
        self.step = 0
        self.summary: dict[str, str] = {}
        self.tags: list[str] = []

    def init(self, *, tags, **_):
        self.tags = tags
        self._called("init")
        return self

    def log(self, row, *, step=None, commit=True) -> None:
        self._called("log")
        assert commit == (step is not None), "what has no step goes with the next that has"
        self.rows.append({**row, "step": step})

    def finish(self, *, exit_code) -> None:
        self._called(f"finish {exit_code}")

    def _called(self, what: str) -> None:
        self.calls.append(what)
        self._trouble(what.split()[0])


def wandb_tracker(
    *, mode: str = "offline", every: int = 1, tags: Sequence[str] = (), cls=WeightsAndBiases
) -> WeightsAndBiases:
    return cls(project="p", mode=mode, tags=tags, network=False, options={}, every=every)


@pytest.fixture
def watch(monkeypatch, tmp_path):
    """Starts a tracker on a fake wandb."""

    def start(trouble=lambda _: None):
        wandb = FakeWandb(trouble)
        monkeypatch.setitem(sys.modules, "wandb", wandb)
        watched = wandb_tracker(mode="online")
        watched.start(folder=tmp_path, settings=SETTINGS, label=LABEL)
        return wandb, watched

    return start


def test_rows_arrive_in_order_without_what_is_empty(watch, caplog) -> None:
    wandb, watched = watch()
    for step in range(100):
        watched.step({"step": step, "loss": None if step % 2 else 0.5})
    watched.finish(RuntimeError("power cut"))
    watched.finish(RuntimeError("power cut"))  # whatever happens
    assert [row["step"] for row in wandb.rows] == list(range(100))
    assert [("train/loss" in row) for row in wandb.rows[:2]] == [True, False]
    assert wandb.calls[-1] == "finish 1"
    assert not caplog.records


@pytest.mark.parametrize(
    ("failure", "code", "reason"),
    [
        (None, 0, ""),
        (ValueError("x" * 1000), 1, f"ValueError: {'x' * 488}"),
        (KeyboardInterrupt(), 1, "KeyboardInterrupt: "),
        (Interrupted(signal.SIGTERM), 143, "interrupted by SIGTERM"),
    ],
)
def test_it_is_told_why_a_run_ended(watch, failure, code: int, reason: str) -> None:
    wandb, watched = watch()
    watched.finish(failure)
    assert wandb.calls[-1] == f"finish {code}"
    assert wandb.summary == {"failure": reason}
    assert len(reason) <= 500


def test_a_row_is_logged_as_it_was(watch) -> None:
    gate = threading.Event()
    wandb, watched = watch(lambda _: gate.wait(60))
    row = {"step": 1, "loss": 0.5}
    watched.step(row)
    row["step"] = 2
    gate.set()
    watched.finish(None)
    assert wandb.rows == [{"step": 1, "train/loss": 0.5}]


@pytest.mark.parametrize("where", ["init", "log", "finish"])
@pytest.mark.parametrize("error", [OSError("No space left on device"), SystemExit(1)])
def test_what_fails_is_said_once(watch, caplog, tmp_path: Path, where, error) -> None:
    def trouble(what):
        if what == where:
            raise error

    wandb, watched = watch(trouble)
    for step in range(5):
        watched.step({"step": step})
    watched.finish(None)
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert f"Weights & Biases failed ({type(error).__name__}: {error})" in record.message
    assert f"it lacks some rows; all of them are in the files of {tmp_path}" in record.message
    assert wandb.calls[-1].split()[0] == where, "nothing is called after that"
    assert [call.split()[0] for call in wandb.calls].count(where) == 1


def test_what_hangs_holds_nothing_up(watch, caplog, monkeypatch) -> None:
    monkeypatch.setattr(remote, "FINISH_SECONDS", 0.1)
    monkeypatch.setattr(remote, "LEEWAY_SECONDS", 0.1)
    monkeypatch.setattr(remote, "CAPACITY", 50)
    gate = threading.Event()
    wandb, watched = watch(lambda what: gate.wait(60) if what == "log" else None)
    begun = time.monotonic()
    for step in range(2000):
        watched.step({"step": step})
    logged = time.monotonic()
    watched.finish(None)
    ended = time.monotonic()
    gate.set()
    assert logged - begun < 2
    assert ended - logged < 5
    said = caplog.text
    assert "takes no more calls: 50 are waiting already" in said
    assert "the run ends without it" in said
    lost = re.search(r"has lost (\d+) calls", said)
    assert lost is not None
    assert 1940 <= int(lost[1]) <= 1960
    assert len(caplog.records) == 3
    assert wandb.rows == [] or len(wandb.rows) <= 52


def test_the_last_evaluation_is_not_lost_where_it_is_made_again(watch) -> None:
    """W&B begins a run that goes on after its last step, and ignores what is of earlier ones."""
    gate = threading.Event()
    wandb, watched = watch(lambda what: gate.wait(60) if what == "init" else None)
    wandb.step = 8  # it has seen step 7
    gate.set()
    for step in (5, 7, 8, 9):  # of a longer run the first is of before its learning rate fell
        watched.step({"step": step, "loss": 0.5})
    watched.finish(None)
    assert [row["step"] for row in wandb.rows] == [None, 8, 9]


def test_the_end_is_told_where_too_many_calls_wait(watch, caplog, monkeypatch) -> None:
    """Of steps that are faster than the program some are lost, and not the result."""
    monkeypatch.setattr(remote, "CAPACITY", 5)
    wandb, watched = watch(lambda what: time.sleep(0.01) if what == "log" else None)
    for step in range(200):
        watched.step({"step": step})
    watched.finish(None)
    assert wandb.calls[-1] == "finish 0"
    assert "has lost" in caplog.text


def test_rows_go_on_where_the_network_comes_back(watch, caplog) -> None:
    gate = threading.Event()
    wandb, watched = watch(lambda what: gate.wait(60) if what == "init" else None)
    for step in range(50):
        watched.step({"step": step})
    assert wandb.rows == []
    gate.set()
    watched.finish(None)
    assert len(wandb.rows) == 50
    assert not caplog.records


def test_without_wandb_the_run_does_not_start(monkeypatch, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)  # as if it were not installed
    watched = wandb_tracker()
    with pytest.raises(RuntimeError, match=r"tracker=wandb: .* choose tracker=local"):
        watched.start(folder=tmp_path, settings=SETTINGS, label=LABEL)
    watched.finish(RuntimeError("power cut"))


def test_tags_of_configuration_and_environment_come_beside_ours(monkeypatch, tmp_path) -> None:
    wandb = FakeWandb()
    monkeypatch.setitem(sys.modules, "wandb", wandb)
    monkeypatch.setenv("WANDB_TAGS", "cluster,night")
    watched = wandb_tracker(tags=["x" * 65, 7])
    watched.start(folder=tmp_path, settings=SETTINGS, label={**LABEL, "scene": "y" * 65})
    watched.finish(None)
    ours = ["scene=" + "y" * 58, "sampler=m", "seed=0"]
    assert wandb.tags == [*ours, "x" * 64, "7", "cluster", "night"]


def test_one_of_several_steps_is_passed_on(monkeypatch, tmp_path) -> None:
    wandb = FakeWandb()
    monkeypatch.setitem(sys.modules, "wandb", wandb)
    watched = wandb_tracker(every=3)
    watched.start(folder=tmp_path, settings=SETTINGS, label=LABEL)
    for step in range(1, 10):
        watched.step({"step": step, "loss": 0.5})
    watched.finish(None)
    assert [row["step"] for row in wandb.rows] == [3, 6, 9]


def test_no_step_at_all_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tracker\.every: 0; expected at least 1"):
        wandb_tracker(every=0)


@pytest.mark.parametrize(
    "watched",
    [
        TensorBoard(options={}, every=1),
        MLflow(uri="sqlite://", experiment="e", options={}, every=1),
    ],
    ids=["tensorboard", "mlflow"],
)
def test_what_to_install_is_said(monkeypatch, tmp_path, watched) -> None:
    monkeypatch.setattr(lightning_trackers, "find_spec", lambda _: None)
    name = type(watched).extra
    message = rf"tracker={name}: {name} is not installed; `pip install .* -e .*\[{name}\].`"
    with pytest.raises(RuntimeError, match=message):
        watched.start(folder=tmp_path, settings=SETTINGS, label=LABEL)
    watched.finish(RuntimeError("power cut"))


def test_an_id_is_made_once_and_stays(tmp_path) -> None:
    ids = iter("abc")
    assert remote.kept_id(tmp_path, "wandb", lambda: next(ids)) == "a"
    assert remote.kept_id(tmp_path, "mlflow", lambda: next(ids)) == "b"
    assert remote.kept_id(tmp_path, "wandb", lambda: next(ids)) == "a"


def test_runs_belong_together_by_sweep_experiment_or_budget() -> None:
    for options, expected in (
        ({"sweeps": "cnsr", "experiment": "demo"}, "cnsr"),
        ({"experiment": "demo"}, "demo"),
        ({"experiment": None}, "b"),
    ):
        assert remote.group(LABEL, SETTINGS, options) == expected
        counted = {"budget": {"clock": "model"}}
        assert remote.group(LABEL, counted, options) == f"{expected}-model-clock"


@pytest.mark.parametrize(
    ("method", "overrides", "expected"),
    [
        ("ours", "default", "ours"),
        ("ours", "method=ours", "ours"),
        ("ours", "a=b,sampler=mine,method=ours,c=d", "ours, a=b, sampler=mine, c=d"),
        (None, "default", "mine"),
        (None, "a=b,sampler=mine,c=d", "mine, a=b, c=d"),
    ],
)
def test_means_over_seeds_are_of_runs_made_alike(method, overrides, expected) -> None:
    """What is swept over tells curves apart that are grouped by job type."""
    label = {**LABEL, "method": method, "sampler": "mine", "overrides": overrides}
    assert remote.job_type(label) == expected
    assert remote.shown_name(label) == f"s/{expected}/0"


def test_job_types_are_as_short_as_wandb_takes_them_and_stay_apart() -> None:
    """`wandb sync` fails where one has more than 64 characters (wandb/wandb#6402)."""
    words = ",".join(f"model.option_{number}=1" for number in range(10))
    a, b = (
        remote.job_type({**LABEL, "overrides": f"{words},optimizer.lr={rate}"}) for rate in (1, 2)
    )
    assert a != b
    assert max(len(a), len(b)) <= 64
    assert a[:20] == b[:20] == "m, model.option_0=1,"


def test_the_lowest_value_is_that_of_all_rows_and_nan_is_none(tmp_path) -> None:
    (tmp_path / "metrics.csv").write_text("step,hard_mape,hard_lpips,a\n1,0.3,,1\n2,0.5,,1\n")
    told = []

    class Told(WeightsAndBiases):
        def _begin(self, folder, settings, label) -> None:
            pass

        def _log(self, row) -> None:
            told.append(row)

        def _end(self, failure) -> None:
            pass

        def _keep(self) -> None:
            pass

    watched = wandb_tracker(cls=Told)
    watched.start(folder=tmp_path, settings=SETTINGS, label=LABEL)
    for value in (math.nan, 0.4, 0.2):
        watched._tell({"step": 3, "hard_mape": value, "hard_lpips": None, "patches": 2})
    watched.finish(None)
    assert [row["best/hard_mape"] for row in told] == [0.3, 0.3, 0.2]
    assert told[1] == {"step": 3, "hard/mape": 0.4, "run/patches": 2, "best/hard_mape": 0.3}
