"""A training of the study of what a choice of patches could gain."""

from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import torch
from hydra.utils import instantiate

from ngi import learn
from ngi.config.build import build_samples
from ngi.patches import Patches
from ngi.studies.ceiling.training import Training
from tests.studies.test_ceiling import configuration

STEPS = 8


def test_each_step_is_taken_at_the_schedules_part_of_the_learning_rates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of Muon's and of Adam's, over all rounds."""
    config = configuration(
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
    with closing(instantiate(config.renderer)) as renderer:
        samples = build_samples(config, renderer=renderer)
        training = Training(config, samples=samples, seed=0, steps=STEPS, folder=tmp_path)
    black = Patches.blank(8, layout=samples.layout, dimensions=samples.dimensions, patch_size=16)
    training.add(black, torch.ones(8))
    training.train(3)
    training.train(STEPS - 3)
    falling = [1.0, 0.1 + 0.9 * (1 + 0.5**0.5) / 2, 0.55, 0.1 + 0.9 * (1 - 0.5**0.5) / 2]
    factors = [0.5, 1.0, 1.0, 1.0, *falling]
    assert [muon for muon, _ in rates] == pytest.approx([0.004 * factor for factor in factors])
    assert [adam for _, adam in rates] == pytest.approx([0.002 * factor for factor in factors])
