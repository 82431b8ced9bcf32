"""Small trainings whose steps are looked at at once, or a step late, with harm done to some."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from ngi.learn import (
    IlluminationModule,
    Outcome,
    StepGuard,
    patch_example,
    seeded,
    training_step,
)
from ngi.learn.module import OptimizerFactory
from ngi.learn.state_before import StateBefore
from ngi.models import L1Dssim, MuonAdam, PixelGenerator, exponential_average
from ngi.render import AnalyticRenderer
from ngi.reuse import DrawingRule, Epochs, FixedProbability
from tests.learn.small_stream import make

LOSS = L1Dssim(l1_weight=1.0, dssim_weight=1.0, window_size=5)
ADAM = partial(torch.optim.Adam, lr=1e-2)
OPTIMIZERS: dict[str, OptimizerFactory] = {"adam": ADAM, "muon": MuonAdam}
STEPS = 30

Known = dict[bytes, int]
"""The number of each step, from 1, by the patches that it is taken on."""


@dataclass(frozen=True)
class Harm:
    """What becomes of one loss, of one element of the gradient, or of a moment, at these steps."""

    loss: dict[int, float] = field(default_factory=dict)
    gradient: dict[int, float] = field(default_factory=dict)
    moment: dict[int, float] = field(default_factory=dict)


class Training:
    """Ours, in small: nothing that is drawn depends on losses, but where a `rule` is given.

    late: whether steps are looked at late, where they can be
    numbers: is filled by a training whose steps are not. A step is known by its patches there,
        since one that is taken again comes after another one's passes
    """

    def __init__(
        self,
        folder: Path,
        *,
        late: bool,
        numbers: Known,
        harm: Harm | None = None,
        optimizer: OptimizerFactory = ADAM,
        rule: DrawingRule | None = None,
        device: str = "cpu",
    ) -> None:
        self.late, self.numbers, self.harm, self.device = late, numbers, harm or Harm(), device
        self.stream = make(
            folder,
            greedy=False,
            rule=rule or Epochs(),
            policy=FixedProbability(bootstrap_batches=3, probability=0.8),
            capacity=24,  # so that patches make room for others
            device=device,
        )
        self.module = IlluminationModule(
            network=seeded(PixelGenerator, seed=0)(
                layout=AnalyticRenderer(dimensions=3, patch_size=8).layout,
                scene_dimensions=3,
                hidden_features=12,
                hidden_layers=2,
            ),
            loss=self._loss,
            optimizer=optimizer,
            example=patch_example,
            stream=self.stream,
            guard=StepGuard(stream=self.stream, folder=folder),
            averaging=partial(exponential_average, decay=0.9),
        ).to(device)
        self.module.network.output_layer.weight.register_hook(self._gradient)  # type: ignore[union-attr]
        self.optimizer = self.module.configure_optimizers()
        self.rates = [group["lr"] for group in self.optimizer.param_groups]
        self.learner = self.module.learner
        if late:
            before = StateBefore(
                network=self.module.network,
                averaged=self.module.averaged,
                optimizer=self.optimizer,
            )
            self.learner = replace(self.learner, before=before)
        self.generated: list[bool] = []  # of each step's batch
        self.outcomes: list[tuple[int, Outcome]] = []  # with the numbers of their steps
        self._now = 0

    def run(self, steps: int) -> None:
        """Up to this step. The learning rate is another one at each."""
        for batch in self.stream:
            number = self.stream.counters.iteration + 1
            self._poison(number)
            self.generated.append(batch.generated)
            step = training_step(batch.to(self.device), self.learner, optimizer=self.optimizer)
            step.when_known(lambda outcome, number=number: self.outcomes.append((number, outcome)))
            for group, rate in zip(self.optimizer.param_groups, self.rates, strict=True):
                group["lr"] = rate * (1 + number % 5)
            if number == steps:
                return

    @property
    def taken_back(self) -> int:
        """How many steps were."""
        return 0 if self.learner.before is None else self.learner.before.restorations

    def state(self) -> dict[str, Any]:
        """All that a checkpoint holds."""
        return {
            "network": self.module.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "guard": self.learner.guard.state_dict(),
            "stream": self.stream.state_dict(),
        }

    def load(self, state: dict[str, Any]) -> None:
        self.module.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.learner.guard.load_state_dict(state["guard"])
        self.stream.load_state_dict(state["stream"])

    def _loss(self, prediction: Tensor, target: Tensor) -> Tensor:
        key = target.detach().cpu().numpy().tobytes()
        self._now = self.numbers.setdefault(key, len(self.numbers) + 1)
        return _harmed(LOSS(prediction, target), self.harm.loss.get(self._now))

    def _gradient(self, gradient: Tensor) -> Tensor:
        return _harmed(gradient, self.harm.gradient.get(self._now))

    def _poison(self, number: int) -> None:
        if number in self.harm.moment:
            state = next(iter(self.optimizer.state.values()))
            moment = state.get("exp_avg", state.get("momentum_buffer"))
            moment.flatten()[0] = self.harm.moment[number]


def _harmed(values: Tensor, value: float | None) -> Tensor:
    """One element has become `value`."""
    if value is None:
        return values
    flat = values.flatten()
    index = (torch.arange(len(flat)) == 1).to(values.device)
    return torch.where(index, flat * 0 + value, flat).reshape(values.shape)
