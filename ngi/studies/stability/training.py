"""NaN, Inf, spikes and wrong learning rates in training, on every sampler and precision."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial

import torch
from torch import Tensor

from ngi.learn import LARGEST_NORM
from ngi.studies.stability.case import PRECISIONS, SAMPLERS, Case, Conditions, Outcome
from ngi.studies.stability.training_run import Disturbance, Disturbances, Trained, train

WHEN = 60
"""Step, or batch, at which something happens: after the bootstrap, before the end."""

LIMIT = 0.5
"""Of how much larger the final error may be than the undisturbed run's. Two seeds differ by up
to 0.3 at this size (eight of each sampler and precision)."""

SPIKE = 1e4

OVER = {"sampler": SAMPLERS, "precision": PRECISIONS}


@lru_cache
def ordinary(conditions: Conditions) -> Trained:
    """The run in which nothing happens."""
    return train(conditions)


def _compare(trained: Trained, conditions: Conditions, *, done: str, expected: bool) -> Outcome:
    undisturbed = ordinary(conditions).error
    return Outcome(
        finite=trained.weights_finite and math.isfinite(trained.error),
        error=trained.error / undisturbed - 1,
        limit=LIMIT,
        done=done,
        as_expected=expected and trained.stopped is None,
    )


def _at(when: int, change: Callable[[Tensor], Tensor]) -> Disturbance:
    return lambda now, values: change(values.clone()) if now == when else values


def _first(value: float) -> Callable[[Tensor], Tensor]:
    """Sets one number."""

    def change(values: Tensor) -> Tensor:
        mask = torch.arange(values.numel(), device=values.device).reshape(values.shape) == 0
        return torch.where(mask, value, values)

    return change


def _broken_patch(conditions: Conditions, *, value: float) -> Outcome:
    radiance = _at(WHEN // 3, _first(value))  # batches are fewer than steps
    trained = train(conditions, disturbances=Disturbances(radiance=radiance))
    refused = trained.counters.batches_refused
    done = f"{refused} batch refused and replaced"
    return _compare(trained, conditions, done=done, expected=refused == 1)


def _refused_step(conditions: Conditions, disturbances: Disturbances) -> Outcome:
    trained = train(conditions, disturbances=disturbances)
    refused = trained.counters.steps_refused
    return _compare(trained, conditions, done=f"{refused} step skipped", expected=refused == 1)


def _broken_loss(conditions: Conditions, *, value: float) -> Outcome:
    return _refused_step(conditions, Disturbances(losses=_at(WHEN, _first(value))))


def _broken_gradient(conditions: Conditions, *, value: float) -> Outcome:
    return _refused_step(conditions, Disturbances(gradient=_at(WHEN, _first(value))))


def _stops(conditions: Conditions, disturbances: Disturbances) -> Outcome:
    trained = train(conditions, disturbances=disturbances)
    return Outcome(
        finite=trained.weights_finite,
        done=f"stopped after {trained.counters.steps_refused + 1} refused steps, with a report",
        as_expected=trained.stopped is not None and trained.report,
    )


def _every_loss(conditions: Conditions) -> Outcome:
    disturbances = Disturbances(losses=lambda now, losses: losses * math.nan if now > 5 else losses)
    return _stops(conditions, disturbances)


def _poisoned_moments(conditions: Conditions) -> Outcome:
    def poison(step: int, _network: torch.nn.Module, optimizer: torch.optim.Optimizer) -> None:
        if step == WHEN:
            next(iter(optimizer.state.values()))["exp_avg"].flatten()[0] = math.nan

    return _stops(conditions, Disturbances(before_step=poison))


def _spike(conditions: Conditions) -> Outcome:
    """The losses of a step, and with them its gradient, become `SPIKE` times as large."""
    losses = _at(WHEN, lambda losses: losses * SPIKE)
    trained = train(conditions, disturbances=Disturbances(losses=losses))
    scaled = trained.counters.steps_scaled
    done = f"{scaled} gradient scaled down, longest stay of a chain {trained.longest_stay} batches"
    return _compare(trained, conditions, done=done, expected=scaled == 1)


def _bright_patch(conditions: Conditions) -> Outcome:
    """A firefly: one pixel of radiance 1e8."""
    radiance = _at(WHEN // 3, _first(math.log1p(1e8)))
    trained = train(conditions, disturbances=Disturbances(radiance=radiance))
    return _compare(trained, conditions, done="trained on in log1p radiance", expected=True)


def _learning_rate(conditions: Conditions, *, rate: float) -> Outcome:
    trained = train(conditions, overrides=[f"optimizer.lr={rate}"])
    norms = trained.gradient_norms
    return Outcome(
        finite=trained.weights_finite and all(map(math.isfinite, norms)),
        error=trained.error / ordinary(conditions).error - 1,
        done=f"largest gradient {max(norms):.2g}, longest stay {trained.longest_stay} batches",
        as_expected=trained.stopped is None,
    )


def _one_position(conditions: Conditions) -> Outcome:
    """An image no larger than a patch: every patch position is the same patch."""
    trained = train(conditions, overrides=["resolution.start=8"])
    done = f"trained, longest stay of a chain {trained.longest_stay} batches"
    return _compare(trained, conditions, done=done, expected=True)


CASES = (
    Case("NaN in a rendered patch", partial(_broken_patch, value=math.nan), OVER),
    Case("Inf in a rendered patch", partial(_broken_patch, value=math.inf), OVER),
    Case("firefly: a pixel of radiance 1e8", _bright_patch, OVER),
    Case("NaN in a loss", partial(_broken_loss, value=math.nan), OVER),
    Case("Inf in a loss", partial(_broken_loss, value=math.inf), OVER),
    Case("NaN in a gradient", partial(_broken_gradient, value=math.nan), OVER),
    Case(
        "gradient whose square overflows",
        partial(_broken_gradient, value=4 * LARGEST_NORM),
        OVER,
    ),
    Case("NaN in Adam's moments", _poisoned_moments, OVER),
    Case("NaN in every loss", _every_loss, OVER),
    Case("a step's loss 1e4 times as large", _spike, OVER),
    Case("resolution equal to the patch", _one_position, OVER),
    *(
        Case(f"learning rate {rate:g}", partial(_learning_rate, rate=rate), OVER)
        for rate in (1e-6, 1e-4, 1e-2, 1e-1)
    ),
)
