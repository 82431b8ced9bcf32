"""What is not finite, at each place where it can come from, in real training on closed formulas."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from ngi.explore import LossTimesStep
from ngi.learn import (
    ExplorationDataModule,
    IlluminationModule,
    StepGuard,
    patch_example,
    seeded,
)
from ngi.learn.lightning_api import Callback, Trainer
from ngi.learn.module import OptimizerFactory
from ngi.learn.step_guard import (
    LARGEST_NORM,
    OUTLIER,
    REFUSED_IN_A_ROW,
    Attempt,
    largest_moment,
)
from ngi.learn.stream import TrainingStream
from ngi.models import L1Dssim, MuonAdam, PixelGenerator
from ngi.models.pixel_mlp import PixelMLP
from ngi.render import AnalyticRenderer, RenderedPatches
from tests.learn.late_training import Harm, Training
from tests.learn.lightning_warnings import IGNORED
from tests.learn.small_stream import make
from tests.learn.test_step import module

Disturbance = Callable[[int, Tensor], Tensor]
"""(number of the step, from 1; what is computed) -> what is given on."""

pytestmark = IGNORED

ADAM = partial(torch.optim.Adam, lr=1e-2)
LOSS = L1Dssim(l1_weight=1.0, dssim_weight=1.0, window_size=5)


@dataclass
class OddLoss:
    disturb: Disturbance
    stream: TrainingStream | None = None

    def __call__(self, prediction: Tensor, target: Tensor) -> Tensor:
        step = 0 if self.stream is None else self.stream.counters.iteration + 1
        return self.disturb(step, LOSS(prediction, target))


class Weights(Callback):
    """Of the network after each step."""

    def __init__(self, stream: TrainingStream) -> None:
        self.stream = stream
        self.weights: list[Tensor] = []

    def on_train_batch_end(self, _trainer, module, *_) -> None:
        self.weights.append(torch.cat([p.detach().flatten() for p in module.parameters()]))


def unchanged(_step: int, values: Tensor) -> Tensor:
    return values


def train(
    folder: Path,
    steps: int,
    *,
    losses: Disturbance = unchanged,
    gradient: Disturbance = unchanged,
    renderer: AnalyticRenderer | None = None,
    callbacks: Sequence[Callback] = (),
    optimizer: OptimizerFactory = ADAM,
    features: int = 8,
) -> Weights:
    stream = make(folder, renderer=renderer, target=LossTimesStep())
    module = IlluminationModule(
        network=seeded(PixelGenerator, seed=0)(
            layout=AnalyticRenderer(dimensions=3, patch_size=8).layout,
            scene_dimensions=3,
            hidden_features=features,
            hidden_layers=2,
        ),
        loss=OddLoss(losses, stream),
        optimizer=optimizer,
        example=patch_example,
        stream=stream,
        guard=StepGuard(stream=stream, folder=folder),
    )
    module.network.output_layer.weight.register_hook(
        lambda g: gradient(stream.counters.iteration + 1, g)
    )
    weights = Weights(stream)
    trainer = Trainer(
        max_steps=steps,
        accelerator="cpu",
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        callbacks=[weights, *callbacks],
    )
    trainer.fit(module, ExplorationDataModule(stream=stream))
    return weights


def at(step: int, value: float) -> Disturbance:
    """One element becomes `value` at this step."""

    def disturb(now: int, values: Tensor) -> Tensor:
        if now != step:
            return values
        flat = values.flatten()
        index = torch.arange(len(flat)) == 1
        return torch.where(index, flat * 0 + value, flat).reshape(values.shape)

    return disturb


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30, 1e20])
def test_a_harmful_gradient_is_refused_and_named_and_training_goes_on(
    tmp_path: Path, value: float, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="ngi"):
        trained = train(tmp_path, 12, gradient=at(6, value))
    assert trained.stream.counters.steps_refused == 1
    assert "step 6 is skipped" in caplog.text
    assert "network.output_layer.weight" in caplog.text
    assert torch.equal(trained.weights[5], trained.weights[4])
    assert all(not torch.equal(a, b) for a, b in pairwise(trained.weights[5:]))
    assert trained.weights[-1].isfinite().all()
    assert not (tmp_path / "refused_step.pt").exists()


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_loss_that_is_not_finite_is_refused_and_names_its_patch(
    tmp_path: Path, value: float, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="ngi"):
        trained = train(tmp_path, 8, losses=at(2, value))
    assert trained.stream.counters.steps_refused == 1
    assert f"the loss of samples [1] (patches [5] of the store) is [{value}]" in caplog.text
    assert trained.stream.store.non_finite_losses == 1
    assert trained.weights[-1].isfinite().all()


@pytest.mark.parametrize("late", [False, True])
def test_a_step_that_is_refused_leaves_the_average_of_the_weights(
    tmp_path: Path, late: bool
) -> None:
    def run(name: str, harm: Harm | None = None) -> Training:
        training = Training(tmp_path / name, late=late, numbers={}, harm=harm)
        training.run(10)
        return training

    generated = run("whole").generated
    stored = generated.index(False) + 1
    for harmed in (1, stored):
        training = run(f"harmed {harmed}", Harm(loss={harmed: math.nan}))
        assert training.stream.counters.steps_refused == 1
        assert training.module.averaged is not None
        assert training.module.averaged.n_averaged == 9


def test_a_large_gradient_is_scaled_down_to_the_average_and_taken(tmp_path: Path) -> None:
    squares: list[Tensor] = []

    class Moments(Callback):
        def on_train_batch_end(self, trainer, *_) -> None:
            states = trainer.optimizers[0].state.values()
            squares.append(sum((state["exp_avg_sq"].sum() for state in states), torch.zeros(())))

    trained = train(tmp_path, 6, gradient=at(4, LARGEST_NORM / 4), callbacks=[Moments()])
    counters = trained.stream.counters
    assert (counters.steps_refused, counters.steps_scaled) == (0, 1)
    assert not torch.equal(trained.weights[3], trained.weights[2])
    gained = squares[3] - 0.999 * squares[2]  # (1 - beta2) times the squared norm
    first = squares[0]  # the average moves little in four steps
    assert 0.3 < gained / first < 3


def test_a_large_gradient_is_no_more_than_an_average_one_to_muon(tmp_path: Path) -> None:
    momenta: list[float] = []

    class Momenta(Callback):
        def on_train_batch_end(self, trainer, *_) -> None:
            states = trainer.optimizers[0].state.values()
            momenta.append(sum(float(s["momentum_buffer"].norm()) for s in states if len(s) == 1))

    trained = train(
        tmp_path,
        6,
        gradient=at(4, LARGEST_NORM / 4),
        callbacks=[Momenta()],
        optimizer=MuonAdam,
        features=12,
    )
    assert trained.stream.counters.steps_scaled == 1
    assert trained.weights[-1].isfinite().all()
    assert momenta[3] < 2 * momenta[2]


def test_gradients_that_stay_large_are_taken_as_they_are_in_the_end(tmp_path: Path) -> None:
    def larger(step: int, gradient: Tensor) -> Tensor:
        return gradient * (1e6 if step > 5 else 1)

    counters = train(tmp_path, 400, gradient=larger).stream.counters
    # The average of logarithms follows by 1 / 100 per step: ln(100) = ln(1e6) 0.99^n.
    expected = math.log(math.log(1e6) / math.log(100)) / -math.log(0.99)
    assert counters.steps_scaled == pytest.approx(expected, abs=8)


def test_refusals_in_a_row_stop_the_run_with_what_does_the_last_one_again(tmp_path: Path) -> None:
    def always(_: int, losses: Tensor) -> Tensor:
        return losses / 0

    with pytest.raises(FloatingPointError, match=rf"{REFUSED_IN_A_ROW}th skipped in a row.*\.pt"):
        train(tmp_path, 30, losses=always)
    report = torch.load(tmp_path / "refused_step.pt", weights_only=True)
    assert report["step"] == REFUSED_IN_A_ROW
    network = PixelGenerator(
        layout=AnalyticRenderer(dimensions=3, patch_size=8).layout,
        scene_dimensions=3,
        hidden_features=8,
        hidden_layers=2,
    )
    weights = {name.removeprefix("network."): w for name, w in report["weights"].items()}
    network.load_state_dict(weights)
    patches = report["patches"]
    losses = OddLoss(always)(
        network(patches["buffers"], patches["scene_vector"]), patches["log_radiance"]
    )
    assert torch.equal(losses, report["losses"])
    assert report["optimizer"]["state"] == {}  # no step was taken


def attempt_of(stream: TrainingStream, *, loss: float, gradient_norm: float) -> Attempt:
    network = torch.nn.Linear(1, 1)
    return Attempt(
        number=1,
        batch=next(iter(stream)),
        losses=torch.full((4,), loss),
        loss=loss,
        gradient_norm=gradient_norm,
        largest_moment=0.0,
        network=network,
        optimizer=torch.optim.SGD(network.parameters(), lr=1.0),
    )


def test_a_resumed_run_knows_how_large_gradients_were(tmp_path: Path) -> None:
    before, after = (module(make(tmp_path / name), tmp_path) for name in "ab")
    attempt = attempt_of(make(tmp_path / "c"), loss=1.0, gradient_norm=2.0)
    for _ in range(3):
        before.learner.guard.admit(attempt)
    checkpoint: dict[str, Any] = {}
    before.on_save_checkpoint(checkpoint)
    after.on_load_checkpoint(checkpoint)
    assert not after.learner.guard.admits(replace(attempt, gradient_norm=2.1 * OUTLIER))
    assert after.learner.guard.admits(replace(attempt, gradient_norm=1.9 * OUTLIER))


def test_refusals_before_an_interruption_count(tmp_path: Path) -> None:
    stream = make(tmp_path, target=LossTimesStep())
    attempt = attempt_of(stream, loss=math.nan, gradient_norm=1.0)
    before, resumed = (StepGuard(stream=stream, folder=tmp_path) for _ in range(2))
    for _ in range(REFUSED_IN_A_ROW - 1):
        before.admit(attempt)
    resumed.load_state_dict(before.state_dict())
    with pytest.raises(FloatingPointError, match=f"the {REFUSED_IN_A_ROW}th skipped in a row"):
        resumed.admit(attempt)


def test_a_checkpoint_of_before_refusals_were_counted_is_gone_on_from(tmp_path: Path) -> None:
    stream = make(tmp_path, target=LossTimesStep())
    before, resumed = (StepGuard(stream=stream, folder=tmp_path) for _ in range(2))
    older = {key: value for key, value in before.state_dict().items() if key != "in_a_row"}
    resumed.load_state_dict(older)
    assert resumed.state_dict() == before.state_dict()


@pytest.mark.parametrize(
    ("optimizer", "name"),
    [(ADAM, "exp_avg_sq"), (MuonAdam, "exp_avg"), (MuonAdam, "momentum_buffer")],
)
def test_moments_that_hold_nan_never_reach_the_weights(
    tmp_path: Path, optimizer: OptimizerFactory, name: str
) -> None:
    class Poison(Callback):
        def on_train_batch_start(self, trainer, _module, *_) -> None:
            states = trainer.optimizers[0].state.values()
            for moments in [state[name] for state in states if name in state][:1]:
                moments.flatten()[0] = math.nan

    with pytest.raises(FloatingPointError, match="moments hold NaN or Inf"):
        train(tmp_path, 30, callbacks=[Poison()], optimizer=optimizer, features=12)
    report = torch.load(tmp_path / "refused_step.pt", weights_only=True)
    assert report["step"] == 1 + REFUSED_IN_A_ROW  # before the first there are no moments
    assert all(weights.isfinite().all() for weights in report["weights"].values())


def test_refusals_with_steps_between_them_do_not_stop_the_run(tmp_path: Path) -> None:
    def every_second(step: int, losses: Tensor) -> Tensor:
        return losses * (math.nan if step % 2 else 1)

    trained = train(tmp_path, 3 * REFUSED_IN_A_ROW, losses=every_second)
    assert trained.stream.counters.steps_refused == 1.5 * REFUSED_IN_A_ROW


class BrokenRenderer(AnalyticRenderer):
    """NaN in a patch of the calls that are listed; Inf in a buffer of all where `always`."""

    def __init__(self, *, calls: set[int] | None) -> None:
        super().__init__(dimensions=3, patch_size=8)
        self._calls = calls
        self._count = 0

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        rendered = super().render_patches(states, resolution=resolution, seed=seed)
        self._count += 1
        if self._calls is None:
            rendered.buffers[:, 0, 0, 0] = math.inf
        elif self._count in self._calls:
            rendered.log_radiance[1, 2, 3] = math.nan
        return replace(rendered)


def test_patches_that_are_not_finite_are_replaced_and_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="ngi"):
        trained = train(tmp_path, 10, renderer=BrokenRenderer(calls={2, 3}))
    assert trained.stream.counters.batches_refused == 2
    assert trained.stream.counters.steps_refused == 0
    assert caplog.text.count("NaN or Inf in the patches of the states [[0.") == 2
    assert "resolution 24, seed " in caplog.text
    store = trained.stream.store
    assert store.get(store.ids).log_radiance.isfinite().all()


def test_a_renderer_that_gives_nothing_finite_stops_the_run(tmp_path: Path) -> None:
    with pytest.raises(FloatingPointError, match="9 batches before: the renderer cannot make"):
        train(tmp_path, 5, renderer=BrokenRenderer(calls=None))


def test_weights_without_entries_have_no_moments() -> None:
    network = PixelMLP(
        pixel_features=3, patch_features=0, hidden_features=32, hidden_layers=2, out_features=3
    )
    optimizer = MuonAdam(network.parameters(), lr=0.1)
    network(torch.rand(2, 5, 3), torch.empty(2, 0)).square().sum().backward()
    optimizer.step()
    assert network.patch_weight.numel() == 0
    kept = [v for s in optimizer.state.values() for n, v in s.items() if n != "step"]
    largest = max(float(moment.abs().max()) for moment in kept if moment.numel())
    assert float(largest_moment(optimizer)) == pytest.approx(largest)
    assert float(largest_moment(torch.optim.Adam([torch.empty(3, 0, requires_grad=True)]))) == 0
