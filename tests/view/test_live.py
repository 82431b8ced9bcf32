"""A run with a page trains as one without, and the page shows what the run does."""

import shutil
import socket
import tracemalloc
from pathlib import Path
from time import monotonic, sleep
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch
from hydra.utils import instantiate

from ngi.learn import PhaseClock
from ngi.render import AnalyticRenderer
from ngi.scene import read_scene
from ngi.train import train
from ngi.view import live
from ngi.view.live import LiveView, axes, live_view
from ngi.view.page import Page
from ngi.view.training_figure import Axis, Visited, training_figure
from tests.config.command_line import composed
from tests.learn.command_line import SMALL, run
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED
from tests.methods.anf import test_runs as anf
from tests.methods.cnsr import test_runs as cnsr
from tests.render.box import BOX

pytestmark = IGNORED


def figure(**changed: Any) -> np.ndarray:
    generator = torch.Generator().manual_seed(0)
    states = torch.rand(40, 4, generator=generator)
    seconds = np.linspace(1, 50, 30)
    arguments: dict[str, Any] = {
        "evaluations": pd.DataFrame({"run_seconds": seconds, "hard_mape": 1 / seconds}),
        "steps": pd.DataFrame(
            {"run_seconds": seconds, "loss_new": 1 / seconds, "reuse_probability": 0.5}
        ),
        "visited": Visited(states, states[:, 0], states[:16]),
        "across": Axis("lamp x", 0),
        "up": Axis("patch y", 3),
        "patches": torch.rand(8, 16, 16, 3, generator=generator),
        "losses": [1.0 / (index + 1) for index in range(8)],
    }
    return training_figure(**{**arguments, **changed})


def test_every_part_of_the_figure_shows_its_data() -> None:
    usual = figure()
    assert usual.dtype == np.uint8
    assert usual.shape[2] == 3
    states = torch.full((40, 4), 0.5)
    for changed in (
        {"evaluations": pd.DataFrame({"run_seconds": [1, 2], "hard_dssim": [0.3, 0.2]})},
        {"steps": pd.DataFrame({"run_seconds": [1, 2], "loss_new": [3, 1]})},
        {"visited": Visited(states, states[:, 0], states[:16])},
        {"across": Axis("lamp y", 1)},
        {"patches": torch.zeros(8, 16, 16, 3)},
        {"losses": [5.0] * 8},
    ):
        assert (figure(**changed) != usual).any(), changed.keys()
    np.testing.assert_array_equal(figure(), usual)


def test_losses_are_shown_however_large_they_are() -> None:
    """Their axis began at 0 and ended at 1."""
    small, large = (
        figure(steps=pd.DataFrame({"run_seconds": [1, 2], "loss_new": [top, top / 2]}))
        for top in (2.0, 40.0)
    )
    assert (small != large).any()


def test_a_long_log_is_not_read_as_a_whole(tmp_path: Path) -> None:
    log, count = tmp_path / "steps.csv", 50_000
    with log.open("w") as stream:
        stream.write("step,loss_new,of another\n")
        stream.writelines(f"{n},{n / 2},{'0' * 200}\n" for n in range(count))
    tracemalloc.start()
    try:
        rows = live._rows(log)
        assert tracemalloc.get_traced_memory()[1] < 3e6
    finally:
        tracemalloc.stop()
    steps = rows["step"].to_numpy()
    assert len(steps) == pytest.approx(1000, abs=1)
    assert (rows["loss_new"] == steps / 2).all()
    assert steps[0] < 10
    assert steps[-1] > 0.998 * count
    distances = np.diff(steps)
    assert distances.min() > 0
    assert distances.max() < 2.1 * distances.min()


def test_a_run_that_has_just_begun_has_a_figure_too() -> None:
    empty = torch.empty(0, 4)
    begun = figure(
        evaluations=pd.DataFrame(),
        steps=pd.DataFrame(),
        visited=Visited(empty, torch.empty(0), torch.zeros(16, 4)),
        patches=torch.empty(0, 16, 16, 3),
        losses=[],
    )
    unscored = figure(
        visited=Visited(torch.rand(5, 4), torch.full((5,), torch.nan), torch.zeros(16, 4))
    )
    assert begun.shape == unscored.shape == figure().shape
    assert (begun != unscored).any()


def test_a_run_with_a_page_trains_as_one_without(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    status, output = run(tmp_path, "run.folder=seen", "viewer=true", f"run.viewer_port={port}")
    assert status == 0, output
    assert f"watch the training at http://127.0.0.1:{port}" in output
    status, output = run(tmp_path, "run.folder=unseen")
    assert status == 0, output
    checkpoints = [
        torch.load(tmp_path / name / "last.ckpt", weights_only=True) for name in ("seen", "unseen")
    ]
    for name, weights in checkpoints[0]["state_dict"].items():
        assert torch.equal(weights, checkpoints[1]["state_dict"][name]), name
    # who looks on is no part of a run's identity
    assert checkpoints[0]["run_identity"] == checkpoints[1]["run_identity"]


@pytest.mark.parametrize("options", [anf.SHORT, cnsr.RUN], ids=["anf", "cnsr"])
def test_the_page_shows_runs_whose_samples_are_several_images(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[dict[str, Any]] = []

    def seen(**what: Any) -> np.ndarray:
        shown.append(what)
        return training_figure(**what)

    monkeypatch.setattr(Page, "visitors", 1)
    monkeypatch.setattr(live, "training_figure", seen)
    page = ("viewer=true", "run.viewer_port=0", "budget.steps=3")
    train(run_config(*options, *page, f"run.folder={tmp_path / 'run'}"))
    assert shown
    assert shown[-1]["patches"].shape[1:] == (16, 16, 3)
    states = torch.arange(12.0)[None]
    places = {axis.name: float(states[0, axis.component]) for axis in axes(["x", "y"])}
    assert places == {"x": 0, "y": 1, "patch x": 10, "patch y": 11}


def test_a_training_goes_on_when_its_picture_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(**_: Any) -> np.ndarray:
        raise MemoryError

    monkeypatch.setattr(Page, "visitors", 1)
    monkeypatch.setattr(live, "training_figure", broken)
    page = ("viewer=true", "run.viewer_port=0", "budget.steps=3")
    train(run_config(*SMALL, *page, f"run.folder={tmp_path / 'run'}"))
    assert (tmp_path / "run" / "result.json").exists()
    assert "the viewer could not draw the training; training continues" in caplog.text


def test_two_rotations_of_one_object_are_two_axes(tmp_path: Path) -> None:
    shutil.copytree(BOX, tmp_path / "box")
    text = (BOX / "scene.yaml").read_text().split("variables:")[0]
    turn = "{object: ball, property: rotation, axis: [0, 1, 0], minimum: 0, maximum: 90}"
    (tmp_path / "box" / "scene.yaml").write_text(f"{text}variables: [{turn}, {turn}]\n")
    of_run: Any = SimpleNamespace(
        folder=SimpleNamespace(path=tmp_path),
        renderer=AnalyticRenderer(dimensions=2, patch_size=16),
    )
    protocol = instantiate(composed("evaluation=small").evaluation.evaluator.protocol)
    description = read_scene(tmp_path / "box")
    view = live_view(of_run, scene_name="box", description=description, protocol=protocol, port=0)
    view.close()
    assert view._panel._across.options == ("ball.rotation", "ball.rotation_2", "patch x", "patch y")


class Recorded:
    """Stands for page, studio, stream and folder; keeps when what was asked for."""

    def __init__(self, *, visitors: int) -> None:
        self.visitors = visitors
        self.waiting = True
        self.calls: list[str] = []
        self.gui = self.chains = self.store = None
        self.chain_record = None

    def catch_up(self) -> None:
        self.calls.append("finish")

    def work(self, *, wait: float) -> bool:
        assert wait == 0
        self.calls.append("work")
        sleep(0.02)
        return True

    def network_changed(self) -> None:
        self.calls.append("changed")


@pytest.mark.parametrize("visitors", [0, 1])
def test_the_clock_stands_still_and_half_of_the_time_is_training(
    monkeypatch: pytest.MonkeyPatch, visitors: int
) -> None:
    monkeypatch.setattr(live, "TrainingPanel", lambda *_: SimpleNamespace(show=lambda **_: None))
    monkeypatch.setattr(LiveView, "_refresh", lambda _: None)
    recorded, clock = Recorded(visitors=visitors), PhaseClock()
    of_run: Any = SimpleNamespace(stream=recorded, clock=clock)
    view = LiveView(
        of_run,
        page=recorded,  # type: ignore[arg-type]
        studio=recorded,  # type: ignore[arg-type]
        variables=["x"],
    )
    clock.start()
    begin = monotonic()
    while monotonic() - begin < 0.5:
        sleep(0.001)  # a step
        view.on_train_batch_end()
    clock.stop()
    passed = monotonic() - begin
    if not visitors:
        assert recorded.calls == []
        return
    assert recorded.calls[:3] == ["finish", "changed", "work"]
    assert recorded.calls.count("changed") == 1
    assert clock.run_seconds == pytest.approx(passed - clock.seconds["evaluate"], abs=0.02)
    assert 0.3 * passed < clock.seconds["evaluate"] < 0.6 * passed
