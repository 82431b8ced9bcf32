"""The network of a run opened again: the one that was evaluated."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.evaluate import tone_map
from ngi.evaluate.pictures import eight_bit
from ngi.learn.supersampling import edges
from ngi.train import train
from ngi.view.run_settings import make_samples
from ngi.view.trained_run import TrainedRun
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED
from tests.learn.moving_camera import MovingCamera

pytestmark = IGNORED


def test_its_edges_are_those_that_were_evaluated(tmp_path: Path) -> None:
    train(configuration(tmp_path, "+data.supersampled_edges=true", "budget.steps=12"))
    opened = TrainedRun.open(tmp_path / "run")
    v, resolution = opened.renderer.hard_frames()[3], opened.protocol.resolution
    buffers = opened.renderer.image_buffers(v, resolution=resolution)
    shown = opened.radiance(v, resolution=resolution)
    preview = opened.predict(buffers, v, preview=True).expm1()
    expected = np.asarray(Image.open(tmp_path / "run" / "pictures" / "hard_03_prediction.png"))
    assert np.array_equal(eight_bit(tone_map(shown)), expected)
    assert not np.array_equal(eight_bit(tone_map(preview)), expected)


def test_edges_can_be_supersampled_of_a_run_that_has_them_asked_for_once(tmp_path: Path) -> None:
    train(configuration(tmp_path, "budget.steps=12"))
    finer = TrainedRun.open(tmp_path / "run", supersampled_edges=True)
    plain = TrainedRun.open(tmp_path / "run")
    v = plain.renderer.hard_frames()[3]
    buffers = plain.renderer.image_buffers(v, resolution=48)
    assert torch.equal(finer.predict(buffers, v, preview=True), plain.predict(buffers, v))
    changed = (finer.predict(buffers, v) != plain.predict(buffers, v)).any(dim=-1)
    assert torch.equal(changed, changed & edges(buffers, plain.renderer.layout))
    assert changed.any()


def test_it_is_asked_by_lists_and_arrays_and_keeps_no_gradients(tmp_path: Path) -> None:
    train(configuration(tmp_path, "budget.steps=12"))
    opened = TrainedRun.open(str(tmp_path / "run"))
    v = opened.renderer.hard_frames()[3]
    expected = opened.radiance(v, resolution=32)
    opened.network.render = type(opened.network).render.__wrapped__.__get__(opened.network)
    for same in (v.tolist(), v.numpy().astype(np.float64)):
        found = opened.radiance(same, resolution=32)
        assert np.array_equal(found.numpy(), expected.numpy())


def test_a_network_of_whole_images_cannot_be_asked_for_quarters() -> None:
    settings = {"data": {"_target_": "ngi.methods.cnsr.ObservationSets", "observations": 3}}
    with pytest.raises(ValueError, match="whole images from ObservationSets"):
        make_samples(settings, MovingCamera(patch_size=16), supersampled_edges=True)


@pytest.mark.parametrize("averaging", ["none", "exponential"])
def test_its_weights_are_the_averaged_ones_where_there_are_such(
    tmp_path: Path, averaging: str
) -> None:
    train(configuration(tmp_path, f"averaging={averaging}", "budget.steps=12"))
    opened = TrainedRun.open(tmp_path / "run")
    state = torch.load(tmp_path / "run" / "last.ckpt", weights_only=True)["state_dict"]
    prefix = {"none": "network.", "exponential": "averaged.module."}[averaging]
    for name, weights in opened.network.state_dict().items():
        assert torch.equal(weights.cpu(), state[prefix + name])
    name = "network.output_layer.weight"
    same = torch.equal(opened.network.output_layer.weight.cpu(), state[name])
    assert same == (averaging == "none")
