"""Training steps that would harm the weights are refused, counted and, where they go on, reported.

A gradient that holds NaN or Inf would take the weights with it, and one whose squares overflow
float32 would fill Adam's second moment with Inf, so that these weights never move again. The norm
of the whole gradient tells both; a loss that is not finite need not have such a gradient. Moments
(Adam's two, Muon's momentum) that hold NaN or Inf all the same, from outside, say, would harm the
weights too.

A finite gradient can do harm as well: one 1e4 times as large as the others makes Adam's second
moment so large that the next ten thousand steps are next to none. It is scaled down.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from ngi.files.durable import write_tensors
from ngi.learn.batch import Batch
from ngi.learn.stream import TrainingStream

log = logging.getLogger(__name__)

LARGEST_NORM = math.sqrt(torch.finfo(torch.float32).max)
"""Of a gradient whose squares Adam can hold: 1.8e19."""

OUTLIER = 100.0
"""Times the average norm, from which on a gradient is scaled down to the average."""

AVERAGED = 100
"""Steps that the average, of the norms' logarithms, goes back."""

REPORT = "refused_step.pt"
"""File for the weights, the moments, the batch and its losses; `torch.load` reads it."""

REFUSED_IN_A_ROW = 10
"""Steps after which no other batch will help: the run stops."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """A step up to its backward pass.

    number: of the step, from 1
    losses: [n] of the batch's samples, on the CPU; loss: their weighted mean
    gradient_norm: see the function of this name; largest_moment: likewise
    """

    number: int
    batch: Batch
    losses: Tensor
    loss: float
    gradient_norm: float
    largest_moment: float
    network: nn.Module
    optimizer: torch.optim.Optimizer

    @property
    def usable(self) -> bool:
        """Whether weights and moments stay finite."""
        finite = math.isfinite(self.largest_moment) and math.isfinite(self.loss)
        return finite and self.gradient_norm <= LARGEST_NORM  # which is not so for NaN

    def content(self) -> dict[str, Any]:
        """What it takes to do it again."""
        patches = self.batch.patches.to("cpu")
        return {
            "weights": self.network.state_dict(prefix="network."),
            "optimizer": self.optimizer.state_dict(),
            "patches": {f.name: getattr(patches, f.name) for f in fields(patches)},
            "losses": self.losses,
            "loss_weights": self.batch.loss_weights,
        }


def gradient_norm(network: nn.Module) -> Tensor:
    """L2 norm of the whole gradient, []; NaN or Inf where a part of it is so.

    Weights of a v that has no components hold nothing, which has no norm of its own.
    """
    gradients = [p.grad for p in network.parameters() if p.grad is not None and p.grad.numel()]
    return torch.nn.utils.get_total_norm(gradients) if gradients else torch.zeros(())


def largest_moment(optimizer: torch.optim.Optimizer) -> Tensor:
    """Absolute value over all that it keeps of earlier gradients, []; NaN where one is."""
    moments = [
        value
        for state in optimizer.state.values()
        for name, value in state.items()
        if name != "step" and isinstance(value, Tensor)
    ]
    held = [moment.flatten() for moment in moments if moment.numel()]
    return torch.cat(held).abs().max() if held else torch.zeros(())


class StepGuard:
    """Takes back the gradient of a step that would harm weights or moments: it then does nothing.

    A gradient far larger than the average is scaled down to it, and the step is taken.

    Sampler, store and policy learn of such steps as of any other; they know how to deal with
    losses that are not finite. After `REFUSED_IN_A_ROW` of them the run stops, and a report holds
    what it takes to do the last one again.

    stream: its counters `steps_refused` and `steps_scaled` count
    folder: where `REPORT` is written
    """

    def __init__(self, *, stream: TrainingStream, folder: Path) -> None:
        self._stream = stream
        self._report = folder / REPORT
        self._in_a_row = 0
        self._log_norm: float | None = None  # average of the logarithms

    def state_dict(self) -> dict[str, Any]:
        return {"log_norm": self._log_norm, "in_a_row": self._in_a_row}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._log_norm = state_dict["log_norm"]
        self._in_a_row = state_dict.get("in_a_row", 0)  # which older checkpoints lack

    def admits(self, attempt: Attempt) -> bool:
        """Whether the step is one to be taken, with its gradient as it is."""
        return attempt.usable and self._factor(attempt.gradient_norm) is None

    def admit(self, attempt: Attempt) -> bool:
        """Between the backward pass and the optimiser's step, or later where it `admits` it.

        Gives whether the step is taken, be it with a smaller gradient.

        Raises FloatingPointError for one refusal too many.
        """
        if not attempt.usable:
            self._refuse(attempt, _cause(attempt))
            return False
        self._in_a_row = 0
        factor = self._factor(attempt.gradient_norm)
        self._follow(attempt.gradient_norm)
        if factor is None:
            return True
        self._stream.counters.steps_scaled += 1
        for parameter in attempt.network.parameters():
            if parameter.grad is not None:
                parameter.grad.mul_(factor)
        return True

    def _factor(self, norm: float) -> float | None:
        """By which a gradient of this norm is scaled down to the average; None where it is not."""
        if norm == 0 or self._log_norm is None:
            return None
        above = math.log(norm) - self._log_norm
        return math.exp(-above) if above > math.log(OUTLIER) else None

    def _follow(self, norm: float) -> None:
        if norm == 0:
            return
        log_norm = math.log(norm)
        average = log_norm if self._log_norm is None else self._log_norm
        self._log_norm = average + (log_norm - average) / AVERAGED

    def _refuse(self, attempt: Attempt, cause: str) -> None:
        attempt.optimizer.zero_grad(set_to_none=True)
        self._in_a_row += 1
        self._stream.counters.steps_refused += 1
        step = attempt.number
        log.warning("step %d is skipped: %s", step, cause)
        if self._in_a_row < REFUSED_IN_A_ROW:
            return
        write_tensors(self._report, {"cause": cause, "step": step, **attempt.content()})
        raise FloatingPointError(
            f"step {step} is the {REFUSED_IN_A_ROW}th skipped in a row: {cause}. {self._report} "
            "has the weights, moments and batch. The usual remedy is a lower optimizer.lr, in a "
            "new folder, since that makes it another run"
        )


def _cause(attempt: Attempt) -> str:
    """Of a step that is skipped."""
    losses, batch, norm = attempt.losses, attempt.batch, attempt.gradient_norm
    broken = (~losses.isfinite()).nonzero().flatten().tolist()
    if broken:
        return (
            f"the loss of samples {broken} (patches {batch.ids[broken].tolist()} of the store) "
            f"is {losses[broken].tolist()}"
        )
    if not math.isfinite(attempt.largest_moment):
        return "the optimiser's moments hold NaN or Inf, although no gradient did"
    named = attempt.network.named_parameters(prefix="network")
    unusable = [name for name, parameter in named if not _usable(parameter.grad)]
    return (
        f"the gradient has norm {norm:.3g}, because of "
        f"{', '.join(unusable[:3]) or 'all weights together'}, at losses up to "
        f"{losses.max().item():.3g}"
    )


def _usable(gradient: Tensor | None) -> bool:
    return gradient is None or float(torch.linalg.vector_norm(gradient)) <= LARGEST_NORM
