"""The LightningModule: network, loss and optimiser, and what each step tells the sampler."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import wraps
from inspect import signature
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from ngi.explore import Signals, Target
from ngi.learn.batch import Batch
from ngi.learn.captured_pass import CapturedPass
from ngi.learn.checkpoint import STEP_GUARD
from ngi.learn.graph_trainer import GraphTrainer
from ngi.learn.lightning_api import LightningModule
from ngi.learn.outcome import Step
from ngi.learn.samples import Example, image_of
from ngi.learn.scorer import Scorer
from ngi.learn.state_before import StateBefore
from ngi.learn.step import Learner, training_step
from ngi.learn.step_guard import StepGuard
from ngi.learn.stream import TrainingStream
from ngi.machine.captured import Captured, Function
from ngi.models import Averaging, SampleLoss, no_average
from ngi.patches import Patches

T = TypeVar("T")

OptimizerFactory = Callable[[Iterable[nn.Parameter]], torch.optim.Optimizer]


class IlluminationModule(LightningModule):
    """Lightning's shell around `training_step`, which fits `network` to log1p radiance.

    network, loss, example, stream, guard: see `Learner`
    optimizer: makes the optimiser from the parameters
    averaging: makes the average of the network's weights that `predict` uses in their place
    render: a network's image of what `predict` is given, see `Samples.render`
    """

    def __init__(
        self,
        *,
        network: nn.Module,
        loss: SampleLoss,
        optimizer: OptimizerFactory,
        example: Callable[[Patches], Example],
        stream: TrainingStream,
        guard: StepGuard,
        averaging: Averaging = no_average,
        render: Callable[..., Tensor] = image_of,
    ) -> None:
        super().__init__()
        self.automatic_optimization = False  # the step function says what happens, and when
        self.network = network
        self.averaged = averaging(network)
        self.loss = loss
        self._make_optimizer = optimizer
        self._example = example
        self._render = render
        self._clock = stream.clock
        self._image: Function = self._rendered
        self.learner = Learner(
            network=network,
            averaged=self.averaged,
            loss=loss,
            example=example,
            scorer=self._scorer_of(stream.sampler.target),
            guard=guard,
            stream=stream,
        )

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """ValueError that names the config's group: PyTorch says a number and what it is of."""
        try:
            return self._make_optimizer(self.network.parameters())
        except ValueError as error:
            if str(error).startswith("optimizer."):
                raise
            raise ValueError(f"optimizer: {error}") from error

    def rehearse(self, patches: Patches, *, targets: Iterable[Target] = ()) -> None:
        """Makes a training step's computations without training, before any long work.

        targets: others that are asked for besides the sampler's

        Raises what would otherwise be raised at the first steps: samples that are not what the
        network takes, patches smaller than the loss's window, a loss that is not one per sample,
        an optimiser or a network that a target can not score, a wrong learning rate.
        """
        self._check_inputs(patches)
        optimizer = self.configure_optimizers()
        with self.learner.scorer.watch(patches, patches, optimizer) as score:
            losses, prediction = self.learner.losses(patches)
        if losses.shape != (len(patches),):
            raise ValueError(
                f"loss: {type(self.learner.loss).__name__} gives a tensor of shape "
                f"{list(losses.shape)} for {len(patches)} samples; expected one loss for each"
            )
        score(prediction, losses)
        for target in targets:
            self._scorer_of(target).signals(patches, optimizer)

    def on_fit_start(self) -> None:
        """ValueError for float16, whose losses have to be scaled for their gradients' sake.

        With a `GraphTrainer` what is computed is recorded from here on.
        """
        if getattr(self.trainer.precision_plugin, "scaler", None) is not None:
            raise ValueError(
                f"trainer.precision: {self.trainer.precision} is not supported; "
                "choose bf16-mixed (trainer=bf16) or 32-true (trainer=fp32)"
            )
        if isinstance(self.trainer, GraphTrainer):
            self.record()
            self.learner = replace(self.learner, before=self._before())

    def training_step(self, batch: Batch, batch_idx: int) -> dict[str, Step]:  # noqa: ARG002
        """Takes the step, and hands `Step` to the callbacks under the key 'step'."""
        # Lightning calls this in the precision of the network, which is not that of its gradient.
        with torch.autocast(self.device.type, enabled=False):
            step = training_step(
                batch,
                self.learner,
                optimizer=self._optimizer(),
                precision=self.trainer.precision_plugin.forward_context,
            )
        return {"step": step}

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        checkpoint[STEP_GUARD] = self.learner.guard.state_dict()

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        self.learner.guard.load_state_dict(checkpoint[STEP_GUARD])

    def predict(self, buffers: Tensor, *inputs: Tensor) -> Tensor:
        """One image: buffers [H, W, C] and `Samples.test_inputs` to log1p radiance [H, W, 3].

        By the averaged weights where there are such. On the CPU, wherever the network is.
        """
        on_device = (tensor.to(self.device) for tensor in (buffers, *inputs))
        with torch.no_grad(), self.trainer.precision_plugin.forward_context():
            output: Tensor = self._image(*on_device)[0]
        return output.float().cpu()

    def answers(self, *inputs: Tensor) -> tuple[Tensor, Tensor]:
        """Log1p radiance [n, H, W, 3] by present and by averaged weights, float32 on the CPU.

        inputs: the network's, of [n] images, on any device. Raises ValueError where no weights are
        averaged.
        """
        averaged_network = self.averaged_network()
        on_device = [tensor.to(self.device) for tensor in inputs]
        with torch.no_grad(), self.trainer.precision_plugin.forward_context():
            present, averaged = self.network(*on_device), averaged_network(*on_device)
        return present.float().cpu(), averaged.float().cpu()

    def averaged_network(self) -> nn.Module:
        """Whose answers are to be compared. Raises ValueError where no weights are averaged."""
        if self.averaged is None:
            raise ValueError(
                "averaging: the sampler compares current with averaged weights, but no weights are "
                "averaged; give averaging=exponential"
            )
        return self.averaged.module

    def signals(self, patches: Patches, target: Target) -> Signals:
        """What `target` requires of [n] patches under the present weights and moments.

        In the precision of training; nothing that training depends on changes.
        """
        with self.trainer.precision_plugin.forward_context():
            return self._scorer_of(target).signals(patches.to(self.device), self._optimizer())

    def record(self) -> None:
        """From here on, passes of training steps and images are CUDA graphs, on a GPU."""
        precision = self.trainer.precision_plugin.forward_context
        captured = CapturedPass(self.network, self.loss, precision=precision)
        self.learner = replace(self.learner, captured=captured)
        self._image = Captured(self._rendered, module=self._shown, name="images")

    def _before(self) -> StateBefore | None:
        """Where there is a GPU that would have to be waited for."""
        if self.device.type != "cuda":
            return None
        optimizer = self.optimizers(use_pl_optimizer=False)
        assert isinstance(optimizer, torch.optim.Optimizer)
        return StateBefore(network=self.network, averaged=self.averaged, optimizer=optimizer)

    @property
    def _shown(self) -> nn.Module:
        """The network that images are made by."""
        return self.network if self.averaged is None else self.averaged.module

    def _rendered(self, *inputs: Tensor) -> tuple[Tensor]:
        return (self._render(self._shown, *inputs),)

    def _check_inputs(self, patches: Patches) -> None:
        if not hasattr(self.network, "render"):
            raise ValueError(
                f"model: {type(self.network).__name__} has no method render(buffers, scene_vector)"
                ", which evaluation and viewer need for whole images"
            )
        inputs, _ = self._example(patches)
        takes = signature(self.network.forward)
        try:
            takes.bind(*inputs)
        except TypeError as error:
            raise ValueError(
                f"model and data do not fit: {type(self.network).__name__} takes "
                f"{list(takes.parameters)}, but a sample has {len(inputs)} input tensors; choose a "
                "method, such as method=uniform or method=cnsr, which sets both"
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
        optimizer = self.optimizers()  # Lightning's, around ours: its `step` counts
        assert isinstance(optimizer, torch.optim.Optimizer)
        return optimizer


def seeded(make: Callable[..., T], *, seed: int) -> Callable[..., T]:
    """`make`, with PyTorch's global generator seeded inside it and left as it was outside.

    PyTorch's initialisers know no other generator.
    """

    @wraps(make)
    def seeded_make(**arguments: Any) -> T:
        with torch.random.fork_rng(devices=[]):  # weights are made on the CPU
            torch.default_generator.manual_seed(seed)
            return make(**arguments)

    return seeded_make
