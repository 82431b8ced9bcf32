"""A training of the study of what a choice of patches could gain."""

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hydra.utils import instantiate
from torch import Tensor, nn

from ngi import learn
from ngi.config.build import build_samples
from ngi.patches import BufferLayout, Patches
from ngi.studies.ceiling.training import Training
from tests.studies.test_ceiling import configuration

STEPS = 8


def made(folder: Path, *overrides: str) -> Training:
    config = configuration(folder, *overrides)
    with closing(instantiate(config.renderer)) as renderer:
        samples = build_samples(config, renderer=renderer)
    return Training(config, samples=samples, seed=0, steps=STEPS, folder=folder)


def lit(log_radiance: list[float]) -> Patches:
    """Patches of nothing, each of one log1p radiance."""
    layout = BufferLayout(("position", "albedo"))
    patches = Patches.blank(len(log_radiance), layout=layout, dimensions=2, patch_size=16)
    patches.log_radiance[:] = torch.tensor(log_radiance)[:, None, None, None]
    return patches


def test_each_step_is_taken_at_the_schedules_part_of_the_learning_rates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of Muon's and of Adam's, over all rounds."""
    training = made(
        tmp_path,
        "schedule=warmup_stable_decay",
        *("schedule.warmup_steps=2", "schedule.decay_share=0.5", "schedule.final_factor=0.1"),
        *("optimizer=muon", "optimizer.lr=0.004", "optimizer.adam_lr=0.002"),
    )
    rates: list[list[float]] = []
    step = learn.training_step

    def recorded(*given: Any, optimizer: torch.optim.Optimizer, **options: Any) -> learn.Step:
        rates.append([group["lr"] for group in optimizer.param_groups])
        return step(*given, optimizer=optimizer, **options)

    monkeypatch.setattr(learn, "training_step", recorded)
    training.add(lit([0.0] * 8), torch.ones(8))
    training.train(3)
    training.train(STEPS - 3)
    falling = [1.0, 0.1 + 0.9 * (1 + 0.5**0.5) / 2, 0.55, 0.1 + 0.9 * (1 - 0.5**0.5) / 2]
    factors = [0.5, 1.0, 1.0, 1.0, *falling]
    assert [muon for muon, _ in rates] == pytest.approx([0.004 * factor for factor in factors])
    assert [adam for _, adam in rates] == pytest.approx([0.002 * factor for factor in factors])


class Answering(nn.Module):
    """A network that says the same of every pixel."""

    def __init__(self, answer: float) -> None:
        super().__init__()
        self.answer = answer

    def forward(self, buffers: Tensor, _: Tensor) -> Tensor:
        return torch.full((*buffers.shape[:3], 3), self.answer)


def test_errors_are_those_of_averaged_weights_at_the_pixels_of_a_glimpse(tmp_path: Path) -> None:
    training = made(tmp_path)
    training._module.network = Answering(0.25)
    training._module.averaged.module = Answering(1.5)
    shown = [0.5, 1.5, 4.0]
    glimpse, patches = lit(shown), lit([9.0] * 3)
    patches.buffers[:] = 9.0
    for pixels, seen in (
        (patches.buffers, glimpse.buffers),
        (patches.log_radiance, glimpse.log_radiance),
    ):
        pixels[:, ::4, ::4] = seen[:, ::4, ::4]
    truth = glimpse.log_radiance[:, :4, :4]
    present, averaged, *radiance = np.log(np.expm1([0.25, 1.5, *shown]) + 0.1)
    relative = np.abs(averaged - radiance)
    assert training.errors(patches, truth).tolist() == pytest.approx([1.0, 0.0, 2.5])
    np.testing.assert_allclose(training.relative_errors(patches, truth), relative, atol=1e-6)
    np.testing.assert_allclose(training.losses(patches), relative, atol=1e-6)
    channels = patches.buffers.shape[-1]
    described = training.described(patches)
    assert (described[:, :channels] == 0).all()
    np.testing.assert_allclose(described[:, channels : channels + 3], averaged, rtol=1e-5)
    np.testing.assert_allclose(described[:, -1], averaged - present, rtol=1e-5)


def test_each_patch_moves_the_weights_by_its_factor(tmp_path: Path) -> None:
    def gradient(log_radiance: list[float], weights: list[float]) -> Tensor:
        count = len(weights)
        training = made(tmp_path, "optimizer=adam", f"sampler.chains={count}")
        training.add(lit(log_radiance), torch.tensor(weights, dtype=torch.float64))
        training.train(1)
        network = training._module.network
        return torch.cat([p.grad.flatten() for p in network.parameters() if p.grad is not None])

    alone = gradient([0.5], [1.0])
    assert alone.norm() > 1e-3
    torch.testing.assert_close(gradient([2.0, 0.5, 4.0], [0.0, 1.0, 0.0]), alone / 3)
