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
from functools import partial
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel

from ngi.learn.batch import Batch, Feedback
from ngi.learn.captured_pass import CapturedPass
from ngi.learn.noise import noise_loss
from ngi.learn.outcome import Outcome, Step
from ngi.learn.reading import Reading
from ngi.learn.samples import Example
from ngi.learn.scorer import Scorer, Scores
from ngi.learn.state_before import StateBefore
from ngi.learn.step_guard import Attempt, StepGuard, gradient_norm, largest_moment
from ngi.learn.stream import TrainingStream
from ngi.models import SampleLoss
from ngi.patches import Patches

Queued = Callable[[], tuple[Attempt, Feedback]]
"""The passes of a step that are under way; called, it gives what came of them."""


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
    before: with it, steps whose losses no batch depends on (`TrainingStream.can_do_without`) are
        taken before anybody has looked at them, and taken back where the guard would not have
        admitted them. They are the same steps, and no device is waited for. None: all wait
    """

    network: nn.Module
    averaged: AveragedModel | None
    loss: SampleLoss
    example: Callable[[Patches], Example]
    scorer: Scorer
    guard: StepGuard
    stream: TrainingStream
    captured: CapturedPass | None = None
    before: StateBefore | None = None

    def losses(self, patches: Patches) -> tuple[Tensor, Tensor]:
        """Loss per sample [n], and what the network answered [n, H, W, 3]."""
        inputs, target = self.example(patches)
        prediction = self.network(*inputs)
        return self.loss(prediction, target), prediction


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
    number = learner.stream.counters.iteration + 1
    queue = partial(_passes, batch, learner, precision, number)
    if learner.before is not None and learner.stream.can_do_without(batch):
        return _taken_unseen(batch, learner, learner.before, optimizer, queue)
    step = Step()
    with learner.stream.clock.phase("train"):
        attempt, feedback = queue(optimizer)()  # the one time that the step waits for the device
        _update(learner, optimizer, taken=learner.guard.admit(attempt))
    # The chains accept or refuse what they proposed; store and policy learn of the losses.
    learner.stream.feedback(feedback)
    step.tell(Outcome(attempt.loss, attempt.gradient_norm))
    return step


def _taken_unseen(
    batch: Batch,
    learner: Learner,
    before: StateBefore,
    optimizer: torch.optim.Optimizer,
    queue: Callable[[torch.optim.Optimizer], Queued],
) -> Step:
    """As though the guard had admitted it. The step before is looked at, this one by the next."""
    step, stream = Step(), learner.stream
    with stream.clock.phase("train"):
        queued, restorations = queue(optimizer), before.restorations
        stream.settle()
        if before.restorations > restorations:
            queued = queue(optimizer)  # the weights are others now
        before.keep()
        _update(learner, optimizer, taken=True)

    def finish() -> None:
        with stream.clock.phase("train"):
            attempt, feedback = queued()
            if learner.guard.admits(attempt):
                learner.guard.admit(attempt)
            else:
                with before.restored():
                    attempt, feedback = queue(before.optimizer)()
                    _update(learner, before.optimizer, taken=learner.guard.admit(attempt))
        stream.learn(batch, feedback.losses)
        step.tell(Outcome(attempt.loss, attempt.gradient_norm))

    stream.feedback_later(finish)
    return step


def _passes(
    batch: Batch,
    learner: Learner,
    precision: Callable[[], AbstractContextManager[Any]],
    number: int,
    optimizer: torch.optim.Optimizer,
) -> Queued:
    """Leaves the gradient of the step of this number."""
    losses, loss, scores = _backward(batch, learner, optimizer, precision)
    asked: tuple[Tensor, ...] = ()
    noise: tuple[Tensor, ...] = ()
    if scores is not None or batch.first_half is not None:
        with learner.stream.clock.phase("score"):
            asked = () if scores is None else (scores[0](), scores[1])
            noise = () if batch.first_half is None else (noise_loss(learner.loss, batch),)
    norms = gradient_norm(learner.network), largest_moment(optimizer)
    reading = Reading(losses, loss, *norms, *noise, *asked)

    def known() -> tuple[Attempt, Feedback]:
        told, mean, norm, moment, *others = reading()
        of_noise = others.pop(0) if noise else None
        proposed, current = others or (None, None)
        attempt = Attempt(
            number=number,
            batch=batch,
            losses=told,
            loss=float(mean),
            gradient_norm=float(norm),
            largest_moment=float(moment),
            network=learner.network,
            optimizer=optimizer,
        )
        return attempt, Feedback(told, proposed, current, of_noise)

    return known


def _update(learner: Learner, optimizer: torch.optim.Optimizer, *, taken: bool) -> None:
    optimizer.step()  # counts, but does nothing where the guard has taken the gradient back
    if taken and learner.averaged is not None:
        learner.averaged.update_parameters(learner.network)


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
    if batch.loss_weights is not None and "step_norm" in learner.scorer.requires:
        raise ValueError(
            "sampler.proposal: it weights the losses of what it proposes, and sampler.target reads "
            "the norms of steps, which are then those of weighted losses for proposals alone; give "
            "a target without them, such as ngi.explore.Loss, or weights of None"
        )
    with learner.scorer.watch(batch.patches, batch.current, optimizer) as score:
        losses, prediction = learner.losses(batch.patches)
        return losses, score(prediction, losses)
