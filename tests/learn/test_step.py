"""Lightning's shell around the training step changes nothing of it."""

from dataclasses import replace
from itertools import islice
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from ngi.explore import (
    Acceptance,
    Loss,
    LossTimesStep,
    MarkovChains,
    NormalPerturbation,
    Proposals,
)
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
from tests.learn.small_stream import answer, make

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


class Weighted(NormalPerturbation):
    """A proposal of one's own that weights what it proposes."""

    def propose(self, position, generator, *, batch: int) -> Proposals:
        proposed = super().propose(position, generator, batch=batch)
        return replace(proposed, weight=torch.full((len(position),), 4.0, dtype=torch.float64))


def test_steps_of_weighted_losses_are_no_measure_of_where_chains_should_go(
    tmp_path: Path,
) -> None:
    proposal = Weighted(large_step_probability=0.3, standard_deviation=0.05)
    for target in (Loss(), LossTimesStep()):
        stream = make(tmp_path / type(target).__name__, proposal=proposal, target=target)
        bare = module(stream, tmp_path)
        optimizer = bare.configure_optimizers()
        batches = islice(stream, 2)
        training_step(next(batches), bare.learner, optimizer=optimizer)
        if isinstance(target, Loss):  # the first batch is where chains begin
            assert next(batches).loss_weights is not None
        else:
            with pytest.raises(ValueError, match=r"sampler\.proposal: it weights the losses"):
                training_step(next(batches), bare.learner, optimizer=optimizer)


class Half(Acceptance):
    """A rule of one's own, which does not say whether it looks at targets."""

    def __call__(self, target_proposed, target_current, *_):
        return target_proposed > 0.5 * target_current


def test_a_rule_that_does_not_say_so_is_given_the_targets_of_current_states(
    tmp_path: Path,
) -> None:
    sampler = MarkovChains(
        chains=4,
        proposal=NormalPerturbation(large_step_probability=0.3, standard_deviation=0.05),
        target=Loss(),
        acceptance=Half(),
    )
    stream = make(tmp_path, sampler=sampler)
    for batch in islice(stream, 8):
        stream.feedback(answer(batch))
    assert stream.counters.scored_batches == stream.counters.generated_batches - 1 > 0


def test_float16_is_refused(tmp_path: Path) -> None:
    made = module(make(tmp_path), tmp_path)
    plugin = SimpleNamespace(scaler=object())  # Lightning takes bfloat16 instead on a CPU
    made._trainer = SimpleNamespace(precision="16-mixed", precision_plugin=plugin)  # type: ignore[assignment]
    with pytest.raises(ValueError, match=r"trainer\.precision: 16-mixed .*bf16-mixed"):
        made.on_fit_start()
