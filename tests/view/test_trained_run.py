"""The network of a run opened again: the one that was evaluated."""

from pathlib import Path

import pytest
import torch

from ngi.train import train
from ngi.view.trained_run import TrainedRun
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED


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
