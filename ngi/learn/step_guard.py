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
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from ngi.durable import write_tensors
from ngi.learn.batch import Batch
from ngi.learn.lightning_api import Callback, LightningModule, Trainer
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


def gradient_norm(parameters: Iterable[nn.Parameter]) -> float:
    """L2 norm of the whole gradient; NaN or Inf where a part of it is so."""
    gradients = [p.grad for p in parameters if p.grad is not None]
    return float(torch.nn.utils.get_total_norm(gradients)) if gradients else 0.0


class StepGuard(Callback):
    """Takes back the gradient of a step that would harm weights or moments: it then does nothing.

    A gradient far larger than the average is scaled down to it, and the step is taken.

    Sampler, store and policy learn of such steps as of any other; they know how to deal with
    losses that are not finite. After `REFUSED_IN_A_ROW` of them the run stops, and a report holds
    what it takes to do the last one again.

    stream: its counters `steps_refused` and `steps_scaled` count
    folder: where `REPORT` is written
    """

    def __init__(self, *, stream: TrainingStream, folder: Path) -> None:
        self.gradient_norm = 0.0
        self._stream = stream
        self._report = folder / REPORT
        self._in_a_row = 0
        self._log_norm: float | None = None  # average of the logarithms

    def state_dict(self) -> dict[str, Any]:
        return {"log_norm": self._log_norm}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self._log_norm = state_dict["log_norm"]

    def on_before_backward(self, _trainer: Trainer, _module: LightningModule, loss: Tensor) -> None:
        self._loss = loss.detach()  # not looked at yet: a GPU would be waited for

    def on_before_optimizer_step(
        self, _trainer: Trainer, module: LightningModule, optimizer: torch.optim.Optimizer
    ) -> None:
        self.gradient_norm = gradient_norm(module.parameters())
        gradient_usable = self.gradient_norm <= LARGEST_NORM  # not for NaN
        moments_usable = math.isfinite(_largest_moment(optimizer))
        self._harmless = gradient_usable and moments_usable and math.isfinite(self._loss)
        if self._harmless:
            self._scale_down(module)
            return
        self._unusable = [name for name, p in module.named_parameters() if not _usable(p.grad)]
        self._moments_usable = moments_usable
        optimizer.zero_grad(set_to_none=True)

    def on_train_batch_end(
        self, trainer: Trainer, module: LightningModule, outputs: Any, batch: Batch, *_: Any
    ) -> None:
        """Raises FloatingPointError for one refusal too many."""
        if self._harmless:
            self._in_a_row = 0
            return
        self._in_a_row += 1
        self._stream.counters.steps_refused += 1
        cause = self._cause(outputs["feedback"].losses, batch)
        step = self._stream.counters.iteration + 1
        log.warning("step %d is not taken: %s", step, cause)
        if self._in_a_row < REFUSED_IN_A_ROW:
            return
        self._write(trainer, module, outputs, batch, cause)
        raise FloatingPointError(
            f"step {step} is the {REFUSED_IN_A_ROW}th in a row that is not taken: {cause}. "
            f"Weights, moments and batch are in {self._report}. The usual remedy is a lower "
            "optimizer.lr, in a new folder, since that is another run"
        )

    def _scale_down(self, module: LightningModule) -> None:
        if self.gradient_norm == 0:
            return
        log_norm = math.log(self.gradient_norm)
        average = log_norm if self._log_norm is None else self._log_norm
        self._log_norm = average + (log_norm - average) / AVERAGED
        if log_norm - average <= math.log(OUTLIER):
            return
        self._stream.counters.steps_scaled += 1
        for parameter in module.parameters():
            if parameter.grad is not None:
                parameter.grad.mul_(math.exp(average - log_norm))

    def _cause(self, losses: Tensor, batch: Batch) -> str:
        broken = (~losses.isfinite()).nonzero().flatten().tolist()
        if broken:
            return (
                f"the loss of samples {broken} (patches {batch.ids[broken].tolist()} of the store) "
                f"is {losses[broken].tolist()}"
            )
        if not self._moments_usable:
            return "the optimiser's moments hold NaN or Inf, which no gradient brought there"
        return (
            f"the gradient has the norm {self.gradient_norm:.3g}, from "
            f"{', '.join(self._unusable[:3]) or 'all weights together'} on, at losses up to "
            f"{losses.max().item():.3g}"
        )

    def _write(
        self, trainer: Trainer, module: LightningModule, outputs: Any, batch: Batch, cause: str
    ) -> None:
        patches = batch.patches.to("cpu")
        content = {
            "cause": cause,
            "step": self._stream.counters.iteration + 1,
            "weights": module.state_dict(),
            "optimizer": trainer.optimizers[0].state_dict(),
            "patches": {f.name: getattr(patches, f.name) for f in fields(patches)},
            "losses": outputs["feedback"].losses,
            "loss_weights": batch.loss_weights,
        }
        write_tensors(self._report, content)


def _usable(gradient: Tensor | None) -> bool:
    return gradient is None or float(torch.linalg.vector_norm(gradient)) <= LARGEST_NORM


def _largest_moment(optimizer: torch.optim.Optimizer) -> float:
    """Absolute value, over all that the optimiser keeps of earlier gradients; NaN where one is."""
    moments = [
        value
        for state in optimizer.state.values()
        for name, value in state.items()
        if name != "step" and isinstance(value, Tensor)
    ]
    return float(torch.nn.utils.get_total_norm(moments, norm_type=math.inf)) if moments else 0.0
