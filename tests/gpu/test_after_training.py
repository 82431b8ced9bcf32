"""What is done with a trained network on a pretended GPU: go on, look at it, hand it out."""

import time
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.utils._python_dispatch import _disable_current_modes

from ngi.view import export
from ngi.view.picture import PictureOptions, write_picture
from ngi.view.scene_view import Place
from ngi.view.screen import Screen
from ngi.view.session import SETTLED, Wish
from ngi.view.studio import Shown, Studio
from ngi.view.trained_run import TrainedRun
from tests.gpu.machine import pretended_gpu
from tests.gpu.pretended import CPU, on
from tests.gpu.test_runs import OURS, assert_close, trained
from tests.learn.command_line import SMALL
from tests.learn.comparison import assert_same, final_state
from tests.learn.lightning_warnings import IGNORED, RESUMED
from tests.view.test_studio import fail

pytestmark = [*IGNORED, RESUMED]

RUN = (*SMALL, "run.checkpoint_steps=4")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run, with averaged weights and patches on the GPU."""
    folder = tmp_path_factory.mktemp("finished")
    with pretended_gpu():
        trained(folder, *OURS, "budget.steps=6")
    return folder / "run"


@pytest.mark.usefixtures("gpu")
def test_a_run_that_goes_on_ends_as_an_unbroken_one(tmp_path: Path) -> None:
    trained(tmp_path / "unbroken", *RUN)
    for steps in (7, 12):
        trained(tmp_path / "longer", *RUN, f"budget.steps={steps}")
    ours, theirs = (final_state(tmp_path / name / "run") for name in ("longer", "unbroken"))
    assert_same(ours, theirs)


def test_a_run_from_a_gpu_goes_on_without_one(tmp_path: Path) -> None:
    with pretended_gpu():
        trained(tmp_path / "longer", *RUN, "budget.steps=7")
    state = final_state(tmp_path / "longer" / "run")
    assert {weight.device for weight in state["state_dict"].values()} == {CPU}
    longer = trained(tmp_path / "longer", *RUN)
    assert longer["steps"] == 12
    assert longer["machine"]["gpu"] is None
    trained(tmp_path / "cpu", *RUN)
    assert_close(tmp_path / "cpu", tmp_path / "longer")


@pytest.mark.usefixtures("gpu")
def test_a_picture_of_it_is_written(finished: Path, tmp_path: Path) -> None:
    for name in ("picture.png", "picture.exr"):
        write_picture(
            PictureOptions(run=str(finished), out=str(tmp_path / name), resolution=64, reference=4)
        )
        assert (tmp_path / name).stat().st_size > 0


@pytest.mark.usefixtures("gpu")
def test_the_viewer_shows_what_the_network_says(finished: Path) -> None:
    run = TrainedRun.open(finished)
    assert next(run.network.parameters()).is_cuda
    studio = Studio(renderer=run.renderer, predict=run.predict)
    pictures: list[Shown] = []
    v = tuple(run.renderer.hard_frames()[0].tolist())
    studio.open("a", Wish(Place(v, 24), Screen(exposure=0.0)), pictures.append, fail)
    while studio.work(wait=0):
        pass
    time.sleep(SETTLED)
    while studio.work(wait=0):
        pass
    assert pictures
    assert pictures[-1].pixels.shape == (24, 24, 3)


def test_supersampled_edges_are_those_that_a_cpu_shows(finished: Path) -> None:
    """Shown twice, since the second image of a size is launched as it was recorded."""
    v = TrainedRun.open(finished).renderer.hard_frames()[0]
    expected = TrainedRun.open(finished, supersampled_edges=True).radiance(v, resolution=64)
    with pretended_gpu():
        run = TrainedRun.open(finished, supersampled_edges=True)
        assert next(run.network.parameters()).is_cuda
        for _ in range(3):
            shown = run.radiance(v, resolution=64)
            assert not shown.is_cuda
            torch.testing.assert_close(shown, expected, rtol=2e-2, atol=2e-2)
    once = TrainedRun.open(finished).radiance(v, resolution=64)
    assert not torch.equal(once, expected)


@pytest.mark.usefixtures("gpu")
def test_it_is_exported_from_the_cpu(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """PyTorch's exporter asks C++ for the GPU, so that the pretended one has to leave for it."""
    pytest.importorskip("onnxruntime", reason="the extra 'export' is missing")
    make = torch.onnx.export

    def checked(network: torch.nn.Module, example: tuple[Tensor, ...], **how: Any) -> Any:
        assert not any(on(tensor) for tensor in (*network.parameters(), *example))
        with _disable_current_modes(), pytest.MonkeyPatch.context() as without:
            without.setattr(torch.cuda, "is_available", lambda: False)
            return make(network, example, **how)

    monkeypatch.setattr(torch.onnx, "export", checked)
    out = tmp_path / "network.onnx"
    assert export.main([f"run={finished}", f"out={out}"]) == 0
    assert out.stat().st_size > 0
