"""Lightning's shell around the training step changes nothing of it."""

from itertools import islice
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from ngi.explore import LossTimesStep
from ngi.learn import (
    ExplorationDataModule,
    IlluminationModule,
    StepGuard,
    TrainingStream,
    patch_example,
    seeded,
    training_step,
)
from ngi.learn.lightning_api import Trainer
from ngi.models import L1Dssim, MuonAdam, PixelGenerator
from ngi.render import AnalyticRenderer
from tests.learn.comparison import assert_same
from tests.learn.lightning_warnings import IGNORED
from tests.learn.small_stream import make

pytestmark = IGNORED

STEPS = 12


def module(stream: TrainingStream, folder: Path) -> IlluminationModule:
    return IlluminationModule(
        network=seeded(PixelGenerator, seed=0)(
            layout=AnalyticRenderer(dimensions=3, patch_size=8).layout,
            scene_dimensions=3,
            hidden_features=12,
            hidden_layers=2,
        ),
        loss=L1Dssim(l1_weight=1.0, dssim_weight=1.0, window_size=5),
        optimizer=MuonAdam,  # whose step multiplies matrices
        example=patch_example,
        stream=stream,
        guard=StepGuard(stream=stream, folder=folder),
    )


def trainer(precision: str) -> Trainer:
    return Trainer(
        max_steps=STEPS,
        accelerator="cpu",
        precision=precision,  # type: ignore[arg-type]
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )


@pytest.mark.parametrize("precision", ["32-true", "bf16-mixed"])
def test_within_the_trainer_and_without_it_a_step_is_the_same(
    tmp_path: Path, precision: str
) -> None:
    within, without = (make(tmp_path / name, target=LossTimesStep()) for name in ("a", "b"))
    shelled, bare = module(within, tmp_path), module(without, tmp_path)
    fit = trainer(precision)
    fit.fit(shelled, ExplorationDataModule(stream=within))
    optimizer = bare.configure_optimizers()
    for batch in islice(without, STEPS):
        training_step(
            batch,
            bare.learner,
            optimizer=optimizer,
            precision=lambda: torch.autocast("cpu", torch.bfloat16, enabled="bf16" in precision),
        )
    assert fit.global_step == STEPS
    assert without.counters.scored_batches > 0
    assert_same(shelled.state_dict(), bare.state_dict())
    assert_same(fit.optimizers[0].state_dict(), optimizer.state_dict())
    assert_same(within.state_dict(), without.state_dict())


def test_float16_is_refused(tmp_path: Path) -> None:
    made = module(make(tmp_path), tmp_path)
    plugin = SimpleNamespace(scaler=object())  # Lightning takes bfloat16 instead on a CPU
    made._trainer = SimpleNamespace(precision="16-mixed", precision_plugin=plugin)  # type: ignore[assignment]
    with pytest.raises(ValueError, match=r"trainer\.precision: 16-mixed .*bf16-mixed"):
        made.on_fit_start()
