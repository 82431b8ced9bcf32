"""CNSR as a run, and what is known of it: it learns a scene, and blurs less with more training."""

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from ngi.learn import seeded
from ngi.methods.cnsr import CNSR, ObservationSets
from ngi.models import L1Dssim
from ngi.patches import Patches
from ngi.view.export import ExportOptions, export
from ngi.view.trained_run import TrainedRun
from tests.config.test_values import build
from tests.learn.command_line import run
from tests.learn.comparison import assert_same_run
from tests.learn.composition import run_config
from tests.learn.moving_camera import SCENE_VARIABLES, MovingCamera
from tests.learn.test_resume import kill_after_checkpoint

SIZE = 16
SETS = 4
RUN = (
    *(
        "renderer=analytic",
        "method=cnsr",
        "renderer._target_=tests.learn.moving_camera.moving_camera",
    ),
    *(f"renderer.patch_size={SIZE}", f"resolution.start={SIZE}", "sampler.chains=2"),
    *("model.hidden_features=16", "model.hidden_layers=2", "optimizer.lr=1e-3"),
    *("reuse.policy.beta=1.0", "evaluation=smoke", "budget=steps", "run.folder=run"),
)


def test_patches_in_two_halves_train_as_whole_ones(tmp_path: Path) -> None:
    status, output = run(tmp_path, *RUN, "budget.steps=2", "+renderer.halves=true")
    assert status == 0, output


def rendered(samples: ObservationSets, *, seed: int) -> Patches:
    """Sets of one scene configuration, from cameras drawn at random."""
    states = torch.rand(SETS, samples.dimensions + 2, generator=torch.Generator().manual_seed(seed))
    states[:, :SCENE_VARIABLES] = torch.tensor([0.3, 0.6])
    images = samples.start_patches(states, resolution=SIZE, seed=seed).result()
    return Patches(
        scene_vector=states[:, :-2],
        position=states[:, -2:],
        resolution=torch.full((SETS,), SIZE),
        large_step=torch.ones(SETS, dtype=torch.bool),
        buffers=images.buffers,
        log_radiance=images.log_radiance,
    )


def detail(image: Tensor) -> Tensor:
    """Differences of neighbouring pixels along the rows, in which stripes show."""
    return image[:, :, 1:] - image[:, :, :-1]


@pytest.fixture(scope="module")
def training() -> list[dict[str, float]]:
    """What the network gives of views it has not seen of the one scene it trains on, at times."""
    samples = ObservationSets(renderer=MovingCamera(patch_size=SIZE), observations=3)
    network = seeded(CNSR, seed=0)(layout=samples.layout, hidden_features=48, hidden_layers=3)
    optimizer, loss = (
        torch.optim.Adam(network.parameters(), lr=2e-3),
        L1Dssim(l1_weight=1.0, dssim_weight=1.0),
    )
    test_inputs, truth = samples.example(rendered(samples, seed=10_000))
    found = []
    for step in range(801):
        if step in (0, 40, 800):
            with torch.no_grad():
                output = network(*test_inputs)
            found.append(
                {
                    "loss": loss(output, truth).mean().item(),
                    "detail": (detail(output).norm() / detail(truth).norm()).item(),
                    "lost": ((detail(output) - detail(truth)).norm() / detail(truth).norm()).item(),
                }
            )
        inputs, target = samples.example(rendered(samples, seed=step))
        optimizer.zero_grad()
        loss(network(*inputs), target).mean().backward()
        optimizer.step()
    return found


def test_it_learns_one_scene_configuration(training) -> None:
    first, _, last = training
    assert last["loss"] < 0.15 * first["loss"]


def test_it_blurs_less_with_more_training(training) -> None:
    _, early, late = training
    assert 2 * early["detail"] < late["detail"] < 1.1
    assert late["lost"] < 0.85 * early["lost"]


STEPS = ("budget.steps=40", "run.checkpoint_steps=5")


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken")
    status, output = run(folder, *STEPS, base=RUN)
    assert status == 0, output
    return folder / "run"


def test_a_killed_run_ends_like_an_undisturbed_one(tmp_path: Path, unbroken: Path) -> None:
    kill_after_checkpoint(tmp_path, *RUN, *STEPS)
    assert not (tmp_path / "run" / "result.json").exists(), "it was not killed in time"
    status, output = run(tmp_path, *STEPS, base=RUN)
    assert status == 0, output
    assert_same_run(unbroken, tmp_path / "run")


def test_the_observations_count_as_time_of_a_frame(unbroken: Path) -> None:
    result: dict[str, Any] = json.loads((unbroken / "result.json").read_text())
    assert result["frame_seconds"]["inputs"] > 1e-4, "three images are rendered"
    assert result["frame_seconds"]["network"] > 0
    assert result["label"]["method"] == "cnsr"
    assert result["patches_traced"] == 2 * 4 * result["generated_batches"]


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["resolution.start=32"], ["resolution", "32", f"patch_size = {SIZE}"]),
        (["resolution=growing"], ["resolution", "600", "resolution=constant"]),
        (["renderer.patch_size=18", "resolution.start=18"], ["18 x 18", "renderer.patch_size"]),
        (["sampler=mcmc_loss_step"], ["PatchLinear", "choose a target that needs no step norm"]),
        (["data=patches"], ["model and data do not fit", "CNSR", "2 input tensors"]),
        (
            ["model=pixel_generator"],
            ["model and data do not fit", "PixelGenerator", "4 input tensors"],
        ),
        (["data.observations=0"], ["data.observations is 0"]),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_is_rendered(
    overrides: list[str], words: list[str], tmp_path: Path
) -> None:
    with pytest.raises((ValueError, TypeError)) as refused:
        build(run_config(*RUN[1:], *overrides), tmp_path)
    for word in words:
        assert word in str(refused.value)


def test_a_run_can_be_looked_at_and_not_exported(tmp_path: Path) -> None:
    status, output = run(
        tmp_path, "renderer._target_=ngi.render.AnalyticRenderer", "budget.steps=2", base=RUN
    )
    assert status == 0, output
    opened = TrainedRun.open(tmp_path / "run")
    v = torch.tensor([0.2, 0.4, 0.6])
    inputs = ObservationSets(renderer=opened.renderer, observations=3).test_inputs(
        v, torch.zeros(24, 24, 1)
    )
    buffers = opened.renderer.image_buffers(v, resolution=24)
    expected = torch.expm1(opened.network.render(buffers, *inputs))
    torch.testing.assert_close(opened.radiance(v, resolution=24), expected)
    with pytest.raises(ValueError, match="its network is a CNSR"):
        export(ExportOptions(run=str(tmp_path / "run"), out=str(tmp_path / "network.onnx")))
    assert not (tmp_path / "network.onnx").exists()
