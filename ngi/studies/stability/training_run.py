"""A short training on closed formulas, with the program's own parts, that can be disturbed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from ngi import learn
from ngi.clock.counters import Counters
from ngi.config.build import build_module, build_samples, build_stream
from ngi.config.configuration import composed
from ngi.learn.lightning_api import Callback, Trainer
from ngi.learn.step_guard import REPORT
from ngi.render import Deferred, PocketRenderer, RenderedPatches
from ngi.studies.exploration_map.test_set import TestSet
from ngi.studies.stability.case import Conditions

SIZE = (
    "experiment=exploration_map",
    "model.hidden_features=32",
    "reuse=self_tuning_small",
    "renderer.volume=0.1",
)
"""Of the runs: they take a second or two."""

STEPS = 150
FRAMES = 100

TESTS, BETWEEN = 5, 10
"""Tests at the end of a run whose mean is its error, and the steps between them. The error at one
step differs between two seeds by up to 1.7 times, the mean by up to 1.3."""

Disturbance = Callable[[int, Tensor], Tensor]
"""(number of the step or batch, from 1; what is computed there) -> what is given on."""


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """What happens to a run.

    radiance: of a generated batch, log1p radiance [n, P, P, 3]
    losses: of a step, [n]
    gradient: of a step, of the output layer's weights
    before_step: called with the step's number, network and optimiser
    """

    radiance: Disturbance | None = None
    losses: Disturbance | None = None
    gradient: Disturbance | None = None
    before_step: Callable[[int, torch.nn.Module, torch.optim.Optimizer], None] | None = None


@dataclass
class Trained:
    """A run that has ended.

    error: mean absolute error of log1p radiance over frames spread over the hypercube, mean over
        the last `TESTS` tests; NaN where the run stopped before them
    losses, gradient_norms: of each step
    weights_finite: at the end
    counters: the stream's
    longest_stay: of a chain in one state, in generated batches
    stopped: why the run stopped before its end; None where it did not
    report: whether it left what does the refused step again
    """

    error: float = float("nan")
    losses: list[float] = field(default_factory=list)
    gradient_norms: list[float] = field(default_factory=list)
    weights_finite: bool = False
    counters: Counters = field(default_factory=Counters)
    longest_stay: int = 0
    stopped: str | None = None
    report: bool = False


def train(
    conditions: Conditions,
    *,
    overrides: Sequence[str] = (),
    steps: int = STEPS,
    disturbances: Disturbances | None = None,
) -> Trained:
    """Trains with a sampler and a precision; what stops the run is part of what is returned."""
    disturbances = disturbances or Disturbances()
    config = composed(
        *SIZE, f"sampler={conditions.sampler}", f"trainer={conditions.precision}", *overrides
    )
    renderer = _Disturbed(instantiate(config.renderer), disturbances.radiance)
    trained = Trained()
    with TemporaryDirectory() as name:
        folder = Path(name)
        _fit(config, renderer, disturbances, trained, folder=folder, steps=steps)
        trained.report = (folder / REPORT).exists()
    return trained


def _fit(
    config: DictConfig,
    renderer: _Disturbed,
    disturbances: Disturbances,
    trained: Trained,
    *,
    folder: Path,
    steps: int,
) -> None:
    clock = learn.PhaseClock()
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(config, renderer=renderer, samples=samples, clock=clock, patches=folder)
    module = build_module(config, samples=samples, stream=stream, folder=folder)
    watch = _Watch(stream, disturbances, trained)
    test = _Test(TestSet(renderer.inner, frames=FRAMES), last_step=steps)
    loss = watch.disturbed_loss(module.loss)
    module.learner = replace(module.learner, loss=loss)
    trainer = instantiate(config.trainer)(
        default_root_dir=folder, max_steps=steps, callbacks=[watch, test]
    )
    try:
        trainer.fit(module, learn.ExplorationDataModule(stream=stream))
    except FloatingPointError as error:
        trained.stopped = str(error)
    trained.counters = stream.counters
    module.to("cpu")
    trained.weights_finite = all(bool(p.isfinite().all()) for p in module.parameters())
    trained.error = test.error


class _Test(Callback):
    """Measures the error at the last few steps."""

    def __init__(self, test_set: TestSet, *, last_step: int) -> None:
        self._test_set = test_set
        self._last_step = last_step
        self._errors: list[float] = []

    @property
    def error(self) -> float:
        return mean(self._errors) if len(self._errors) == TESTS else math.nan

    def on_train_batch_end(self, trainer: Trainer, module: Any, *_: Any) -> None:
        left = self._last_step - trainer.global_step
        if left % BETWEEN == 0 and left < TESTS * BETWEEN:
            self._errors.append(self._test_set.errors(partial(_on_cpu, module))["error_uniform"])


def _on_cpu(module: Any, *inputs: Tensor) -> Tensor:
    """What its network says, which may be on a GPU."""
    output: Tensor = module.network(*(tensor.to(module.device) for tensor in inputs))
    return output.cpu()


class _Disturbed:
    """A renderer whose patches something happens to."""

    def __init__(self, inner: PocketRenderer, disturb: Disturbance | None) -> None:
        self.inner = inner
        self._disturb = disturb
        self._batches = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> Any:
        return Deferred(lambda: self._render(states, resolution=resolution, seed=seed))

    def _render(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        rendered = self.inner.render_patches(states, resolution=resolution, seed=seed)
        self._batches += 1
        if self._disturb is None:
            return rendered
        disturbed = self._disturb(self._batches, rendered.log_radiance)
        return replace(rendered, log_radiance=disturbed)


class _Watch(Callback):
    """Disturbs the step, and writes down what happens."""

    def __init__(
        self,
        stream: learn.TrainingStream,
        disturbances: Disturbances,
        trained: Trained,
    ) -> None:
        self._stream = stream
        self._disturbances = disturbances
        self._trained = trained
        self._stays = torch.zeros(stream.sampler.chains, dtype=torch.int64)

    @property
    def _step(self) -> int:
        return self._stream.counters.iteration + 1

    def disturbed_loss(self, loss: Any) -> Any:
        disturb = self._disturbances.losses
        return loss if disturb is None else lambda p, t: disturb(self._step, loss(p, t))

    def on_train_start(self, _trainer: Trainer, module: Any) -> None:
        disturb = self._disturbances.gradient
        if disturb is not None:
            weight = module.network.output_layer.weight
            weight.register_post_accumulate_grad_hook(
                lambda w: setattr(w, "grad", disturb(self._step, w.grad))
            )

    def on_train_batch_start(self, trainer: Trainer, module: Any, *_: Any) -> None:
        if self._disturbances.before_step is not None:
            self._disturbances.before_step(self._step, module.network, trainer.optimizers[0])

    def on_train_batch_end(self, _trainer: Trainer, _module: Any, outputs: Any, *_: Any) -> None:
        self._trained.losses.append(outputs["step"].outcome.loss)
        self._trained.gradient_norms.append(outputs["step"].outcome.gradient_norm)
        if self._stream.chain_record is not None:
            accepted = torch.from_numpy(self._stream.chain_record["accepted"])
            self._stays = torch.where(accepted, 0, self._stays + 1)
            self._trained.longest_stay = max(self._trained.longest_stay, int(self._stays.max()))
