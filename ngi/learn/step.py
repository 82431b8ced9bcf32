"""One training step, from top to bottom (paper, Sec. 5 and 6.1).

    for batch in stream:  # the chains propose; their patches are rendered, or stored ones drawn
        training_step(batch, learner, optimizer=optimizer)  # everything else

Whatever trains takes this step: runs and the measurement of their costs within Lightning's trainer
(`IlluminationModule.training_step`), and so do the stability cases; the map of exploration without.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel

from ngi.learn.batch import Batch, Feedback
from ngi.learn.captured_pass import CapturedPass
from ngi.learn.noise import noise_loss
from ngi.learn.reading import read
from ngi.learn.samples import Example
from ngi.learn.scorer import Scorer, Scores
from ngi.learn.step_guard import Attempt, StepGuard, gradient_norm, largest_moment
from ngi.learn.stream import TrainingStream
from ngi.models import SampleLoss
from ngi.patches import Patches


@dataclass(frozen=True, kw_only=True)
class Learner:
    """What takes part in every step.

    network: of the samples' inputs (buffers [n, H, W, C], scene_vector [n, D], or whatever else) to
        log1p radiance [n, H, W, 3]
    averaged: the average of its weights, which follows each step; None for none
    loss: (prediction, target) -> loss per sample [n]
    example: see `ngi.learn.Samples.example`
    scorer: asks the network for the target density of the chains' states
    guard: refuses or scales down steps that would do harm
    stream: where batches come from, and who learns from each step
    captured: takes forward and backward pass of steps that score nothing; None for kernel by kernel
    """

    network: nn.Module
    averaged: AveragedModel | None
    loss: SampleLoss
    example: Callable[[Patches], Example]
    scorer: Scorer
    guard: StepGuard
    stream: TrainingStream
    captured: CapturedPass | None = None

    def losses(self, patches: Patches) -> tuple[Tensor, Tensor]:
        """Loss per sample [n], and what the network answered [n, H, W, 3]."""
        inputs, target = self.example(patches)
        prediction = self.network(*inputs)
        return self.loss(prediction, target), prediction


@dataclass(frozen=True)
class Step:
    """What came of a step.

    loss: mean over the batch, of the weighted losses
    gradient_norm: L2 norm of the whole gradient, before the guard changed it
    """

    loss: float
    gradient_norm: float


def training_step(
    batch: Batch,
    learner: Learner,
    *,
    optimizer: torch.optim.Optimizer,
    precision: Callable[[], AbstractContextManager[Any]] = nullcontext,
) -> Step:
    """Fits the network to the mean of a batch's losses, and lets the sampler learn from it.

    batch: the last that the stream gave out, on the network's device
    precision: the context that the network computes in; the rest is done in float32
    Raises FloatingPointError where the guard does (`StepGuard.admit`).
    """
    clock = learner.stream.clock
    with clock.phase("train"):
        losses, loss, scores = _backward(batch, learner, optimizer, precision)
        with clock.phase("score"):
            asked = () if scores is None else (scores[0](), scores[1])
            noise = () if batch.first_half is None else (noise_loss(learner.loss, batch),)
        # The one time that a step waits for the device: its time is training's.
        norms = gradient_norm(learner.network), largest_moment(optimizer)
        told, mean, norm, moment, *others = read(losses, loss, *norms, *noise, *asked)
        step = Step(float(mean), float(norm))
        learner.guard.admit(
            Attempt(
                batch=batch,
                losses=told,
                loss=step.loss,
                gradient_norm=step.gradient_norm,
                largest_moment=float(moment),
                network=learner.network,
                optimizer=optimizer,
            )
        )
        optimizer.step()  # does nothing where the guard has taken the gradient back
        if learner.averaged is not None:
            learner.averaged.update_parameters(learner.network)
    # The chains accept or refuse what they proposed; store and policy learn of the losses.
    of_noise = others.pop(0) if noise else None
    proposed, current = others or (None, None)
    learner.stream.feedback(Feedback(told, proposed, current, of_noise))
    return step


def _backward(
    batch: Batch,
    learner: Learner,
    optimizer: torch.optim.Optimizer,
    precision: Callable[[], AbstractContextManager[Any]],
) -> tuple[Tensor, Tensor, Scores | None]:
    """Leaves the gradient; loss per sample [n], weighted mean, and the scores of `_forward`."""
    if learner.captured is not None and batch.current is None:
        return *learner.captured(learner.example(batch.patches), batch.loss_weights), None
    with precision():
        losses, scores = _forward(batch, learner, optimizer)
        weighted = losses if batch.loss_weights is None else losses * batch.loss_weights
        loss = weighted.mean()
    optimizer.zero_grad()
    loss.backward()
    return losses, loss, scores


def _forward(
    batch: Batch, learner: Learner, optimizer: torch.optim.Optimizer
) -> tuple[Tensor, Scores | None]:
    """Loss per sample [n], and the scores of proposed and current states, where they are asked."""
    if batch.current is None:
        return learner.losses(batch.patches)[0], None
    with learner.scorer.watch(batch.patches, batch.current, optimizer) as score:
        losses, prediction = learner.losses(batch.patches)
        return losses, score(prediction, losses)
