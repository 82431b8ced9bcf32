"""The learning rate over a run: a function of its steps and of the part of its budget used."""

import math
from typing import Protocol

from ngi.clock.budget import Budget


class Schedule(Protocol):
    """By what the optimiser's learning rates are multiplied."""

    def factor(self, *, steps: int, used: float) -> float:
        """For the next step. steps: taken so far; used: share of the budget, by the run's clock."""
        ...

    def decays(self, used: float) -> bool:
        """Whether steps depend on how long the run is to be, once so much of its budget is used.

        Up to there a run is the beginning of any longer one.
        """
        ...

    def check(self, budget: Budget) -> None:  # noqa: ARG002
        """ValueError where the schedule does not fit into the budget."""
        return


class ConstantRate(Schedule):
    """The learning rates as they are (the paper's): any run is the beginning of a longer one."""

    def factor(self, *, steps: int, used: float) -> float:  # noqa: ARG002
        return 1.0

    def decays(self, used: float) -> bool:  # noqa: ARG002
        return False


class WarmupStableDecay(Schedule):
    """Rises over the first steps, stays, and falls over the last part of the budget.

    With k steps taken and the part x of the decay over,

        factor = min(1, (k + 1) / warmup_steps) · (final + (1 − final) · (1 + cos πx) / 2).

    While it stays, nothing depends on the budget, so that a run can be trained longer from the
    checkpoint that is the last before the decay, and nothing of it is lost but the decay (Hu et al.
    2024, arXiv 2404.06395; Hägele et al. 2024, arXiv 2405.18392). With a decay over the whole
    budget it is the usual cosine.

    warmup_steps: 0 for none
    decay_share: of the budget, above 0, at most 1
    final_factor: 0 to 1
    Raises ValueError for numbers outside these ranges.
    """

    def __init__(self, *, warmup_steps: int, decay_share: float, final_factor: float) -> None:
        if warmup_steps < 0:
            raise ValueError(f"schedule.warmup_steps: {warmup_steps}; expected at least 0")
        if not 0 < decay_share <= 1:
            raise ValueError(
                f"schedule.decay_share: {decay_share}; expected above 0, at most 1, of the budget"
            )
        if not 0 <= final_factor <= 1:
            raise ValueError(f"schedule.final_factor: {final_factor}; expected 0 to 1")
        self._warmup_steps = warmup_steps
        self._decay_share = decay_share
        self._final = final_factor

    def factor(self, *, steps: int, used: float) -> float:
        warm = min(1.0, (steps + 1) / max(1, self._warmup_steps))
        begin = 1 - self._decay_share
        over = min(1.0, max(0.0, (used - begin) / self._decay_share))
        return warm * (self._final + (1 - self._final) * (1 + math.cos(math.pi * over)) / 2)

    def decays(self, used: float) -> bool:
        return used >= 1 - self._decay_share

    def check(self, budget: Budget) -> None:
        """How many steps fit into seconds is not known beforehand."""
        if budget.steps is not None and self._warmup_steps >= budget.steps:
            raise ValueError(
                f"schedule.warmup_steps: {self._warmup_steps} steps of warm-up do not fit into "
                f"budget.steps: {budget.steps}; raise budget.steps, or set "
                f"schedule.warmup_steps={budget.steps // 4}"
            )
