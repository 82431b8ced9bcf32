"""The LightningModule: network, loss and optimiser, and what each step tells the sampler."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from inspect import signature
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from ngi.explore import Signals, Target
from ngi.learn.batch import Batch, Feedback
from ngi.learn.clock import PhaseClock
from ngi.learn.lightning_api import LightningModule
from ngi.learn.samples import Example
from ngi.learn.scorer import Scorer
from ngi.models import Averaging, SampleLoss, no_average
from ngi.patches import Patches

T = TypeVar("T")

OptimizerFactory = Callable[[Iterable[nn.Parameter]], torch.optim.Optimizer]


class IlluminationModule(LightningModule):
    """Fits `network` to log1p radiance by the mean of `loss` over a batch, weighted as it says.

    network: (buffers [n, H, W, C], scene_vector [n, D], or whatever else the samples give it) ->
        log1p radiance [n, H, W, 3]
    loss: (prediction, target) -> loss per sample [n]
    optimizer: makes the optimiser from the parameters
    averaging: makes the average of the network's weights that `predict` uses in their place
    target: the target density that the chains explore
    example: see `ngi.learn.Samples.example`
    """

    def __init__(
        self,
        *,
        network: nn.Module,
        loss: SampleLoss,
        optimizer: OptimizerFactory,
        target: Target,
        clock: PhaseClock,
        example: Callable[[Patches], Example],
        averaging: Averaging = no_average,
    ) -> None:
        super().__init__()
        self.network = network
        self.averaged = averaging(network)
        self.loss = loss
        self._make_optimizer = optimizer
        self._clock = clock
        self._example = example
        self._scorer = self._scorer_of(target)

    def configure_optimizers(self) -> torch.optim.Optimizer:
        return self._make_optimizer(self.network.parameters())

    def rehearse(self, patches: Patches) -> None:
        """Makes a training step's computations without training, before any long work.

        Raises what would otherwise be raised at the first steps: samples that are not what the
        network takes, patches smaller than the loss's window, an optimiser or a network that the
        target can not score, a wrong learning rate.
        """
        self._check_inputs(patches)
        optimizer = self._make_optimizer(self.network.parameters())
        with self._scorer.watch(patches, patches, optimizer) as score:
            losses, prediction = self._losses(patches)
        score(prediction, losses)

    def training_step(self, batch: Batch, batch_idx: int) -> dict[str, Any]:  # noqa: ARG002
        if batch.current is None:
            losses, _ = self._losses(batch.patches)
            feedback = Feedback(losses.detach(), None, None)
        else:
            with self._scorer.watch(batch.patches, batch.current, self._optimizer()) as score:
                losses, prediction = self._losses(batch.patches)
            feedback = Feedback(losses.detach(), *score(prediction, losses))
        weighted = losses if batch.loss_weights is None else losses * batch.loss_weights
        return {"loss": weighted.mean(), "feedback": feedback}

    def optimizer_step(self, *arguments: Any, **options: Any) -> None:
        """Lightning's, and the average follows: within the time that counts as training."""
        super().optimizer_step(*arguments, **options)
        if self.averaged is not None:
            self.averaged.update_parameters(self.network)

    def _losses(self, patches: Patches) -> tuple[Tensor, Tensor]:
        inputs, target = self._example(patches)
        prediction = self.network(*inputs)
        return self.loss(prediction, target), prediction

    def predict(self, buffers: Tensor, *inputs: Tensor) -> Tensor:
        """One image: buffers [H, W, C] and `Samples.test_inputs` to log1p radiance [H, W, 3].

        By the averaged weights where there are such. On the CPU, wherever the network is.
        """
        network = self.network if self.averaged is None else self.averaged.module
        on_device = (tensor.to(self.device) for tensor in (buffers, *inputs))
        with torch.no_grad(), self.trainer.precision_plugin.forward_context():
            output = network.render(*on_device)  # type: ignore[operator]
        return output.float().cpu()

    def signals(self, patches: Patches, target: Target) -> Signals:
        """What `target` requires of [n] patches under the present weights and moments.

        In the precision of training; nothing that training depends on changes.
        """
        with self.trainer.precision_plugin.forward_context():
            return self._scorer_of(target).signals(patches.to(self.device), self._optimizer())

    def _check_inputs(self, patches: Patches) -> None:
        inputs, _ = self._example(patches)
        takes = signature(self.network.forward)
        try:
            takes.bind(*inputs)
        except TypeError as error:
            raise ValueError(
                f"model and data do not fit: {type(self.network).__name__} takes "
                f"{list(takes.parameters)}, the samples give {len(inputs)} tensors; a method, "
                "method=uniform or method=cnsr, chooses both"
            ) from error

    def _scorer_of(self, target: Target) -> Scorer:
        return Scorer(
            target=target,
            network=self.network,
            loss=self.loss,
            clock=self._clock,
            example=self._example,
        )

    def _optimizer(self) -> torch.optim.Optimizer:
        optimizer = self.optimizers(use_pl_optimizer=False)
        assert isinstance(optimizer, torch.optim.Optimizer)
        return optimizer


def seeded(make: Callable[..., T], *, seed: int) -> Callable[..., T]:
    """`make`, with PyTorch's global generator seeded inside it and left as it was outside.

    PyTorch's initialisers know no other generator.
    """

    def seeded_make(**arguments: Any) -> T:
        with torch.random.fork_rng(devices=[]):  # weights are made on the CPU
            torch.default_generator.manual_seed(seed)
            return make(**arguments)

    return seeded_make
