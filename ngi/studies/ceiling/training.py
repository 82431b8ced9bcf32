"""Training as `ngi train` does it, step by step, on patches that are given as it goes on."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from ngi import learn
from ngi.clock.counters import Counters
from ngi.config.build import build_module, training_device
from ngi.explore import ConstantTarget
from ngi.learn import Batch
from ngi.learn.glimpses import sparse
from ngi.learn.graph_trainer import GraphTrainer
from ngi.patches import Patches


class Training:
    """Network, optimiser and store of one run with a number of steps known beforehand.

    config: of a run; its model, loss, optimiser, schedule, averaging, reuse and trainer count
    folder: for the step guard's report; Lightning writes nothing into it
    """

    def __init__(
        self, config: DictConfig, *, samples: learn.Samples, seed: int, steps: int, folder: Path
    ) -> None:
        config = config.copy()
        config.seed = seed
        self.steps = steps
        self._taken = 0
        self._count = config.sampler.chains
        self._generator = torch.Generator().manual_seed(seed)
        self._device = training_device(config)
        self._store = instantiate(config.reuse.store)(layout=samples.layout, device=self._device)
        self._weights = torch.zeros(0, dtype=torch.float64)  # by id
        self._schedule = instantiate(config.schedule)
        stream: Any = _Answered()
        module = build_module(config, samples=samples, stream=stream, folder=folder)
        self._module = module.to(self._device)
        self._module.trainer = instantiate(config.trainer)(default_root_dir=folder, max_steps=1)
        if isinstance(self._module.trainer, GraphTrainer):
            self._module.record()
        self._optimizer = self._module.configure_optimizers()
        self._rates = learn.BaseRates(self._optimizer)
        self._samples = samples
        self.predict = self._module.predict

    def add(self, patches: Patches, weights: Tensor) -> None:
        """Patches [n] that are trained on from now on, and their losses' factors [n]."""
        self._store.add(patches)
        self._weights = torch.cat([self._weights, weights])

    def train(self, steps: int) -> None:
        """Takes so many steps on stored patches. FloatingPointError where they lead nowhere."""
        for _ in range(steps):
            ids = self._store.draw(self._count, self._generator)
            batch = Batch(
                self._store.get(ids),
                ids,
                generated=False,
                current=None,
                loss_weights=self._weights[ids].float(),
            )
            self._step(batch.to(self._device))

    def errors(self, patches: Patches, truth: Tensor) -> Tensor:
        """[n] mean absolute differences of log1p radiance between prediction and `truth`.

        truth: [n, h, w, 3], at the pixels of `answers`
        """
        return (self.answers(patches) - truth).abs().mean(dim=(1, 2, 3))

    def relative_errors(self, patches: Patches, truth: Tensor) -> Tensor:
        """[n] as a run that looks counts them, see `learn.distances`; truth: as in `errors`."""
        return learn.distances(self.answers(patches), truth)

    def losses(self, patches: Patches) -> Tensor:
        """[n] `relative_errors` against the traced radiance, noise included."""
        return self.relative_errors(patches, sparse(patches.log_radiance.float()))

    def described(self, patches: Patches) -> Tensor:
        """[n, F]: `learn.features` of what a glimpse of each shows."""
        buffers, vectors = self._glimpses(patches)
        return learn.features(buffers, vectors, *self._module.answers(buffers, vectors)).cpu()

    def answers(self, patches: Patches) -> Tensor:
        """[n, h, w, 3] log1p radiance by the averaged weights, at the pixels of a glimpse."""
        averaged = self._module.averaged
        network = self._module.network if averaged is None else averaged.module
        with torch.no_grad(), self._module.trainer.precision_plugin.forward_context():
            answer: Tensor = network(*self._glimpses(patches))
        return answer.float().cpu()

    def _glimpses(self, patches: Patches) -> tuple[Tensor, Tensor]:
        (buffers, vectors), _ = self._samples.example(patches.to(self._device))
        return sparse(buffers).contiguous(), vectors

    def _step(self, batch: Batch) -> None:
        used = self._taken / self.steps
        self._rates.scale(self._schedule.factor(steps=self._taken, used=used))
        learn.training_step(
            batch,
            self._module.learner,
            optimizer=self._optimizer,
            precision=self._module.trainer.precision_plugin.forward_context,
        )
        self._taken += 1


class _Answered:
    """In a stream's place, where no chains learn from the steps."""

    def __init__(self) -> None:
        self.sampler = SimpleNamespace(target=ConstantTarget(), needs_description=False)
        self.clock = learn.PhaseClock()
        self.counters = Counters()

    def feedback(self, _: learn.Feedback) -> None:
        self.counters.iteration += 1
