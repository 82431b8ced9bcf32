"""How far a run is, counted in steps, where it ends with steps on stored patches alone."""

from __future__ import annotations

import math
from collections.abc import Callable

from ngi.clock.budget import Budget
from ngi.clock.counters import Counters
from ngi.clock.phase_clock import RunClock

OF_A_NEW_BATCH = ("explore", "render", "score")
"""Phases that a step on stored patches does without."""


class Progress:
    """The part of its steps that a run has taken, if no further batch is new.

    Where the budget is one of seconds, the steps that are left are those that fit into them: a step
    on stored patches takes what one has taken so far, on average.

    clock: by which the budget ends
    counters: gives the run's counters as they are now
    stored_alone: the last share of the steps, those on stored patches
    """

    def __init__(
        self,
        *,
        budget: Budget,
        clock: RunClock,
        counters: Callable[[], Counters],
        stored_alone: float,
    ) -> None:
        self._budget = budget
        self._clock = clock
        self._counters = counters
        self._stored_alone = stored_alone

    @property
    def too_late(self) -> bool:
        """Whether one more new batch would leave less than the last share of the steps."""
        return self.share(new_batches=1) >= 1 - self._stored_alone

    def share(self, *, new_batches: int = 0) -> float:
        """From 0, before the first step, to 1. new_batches: that come first, all the same."""
        taken = self._counters().iteration
        return taken / (taken + self._left(new_batches)) if taken else 0.0

    def _left(self, new_batches: int) -> float:
        counters, budget = self._counters(), self._budget
        left = math.inf if budget.steps is None else float(budget.steps - counters.iteration)
        if budget.seconds is not None:
            spent, seconds = self._clock.run_seconds, self._clock.seconds
            fresh = sum(seconds[phase] for phase in OF_A_NEW_BATCH)
            of_a_batch = fresh / max(1, counters.generated_batches)
            remaining = budget.seconds - spent - new_batches * of_a_batch
            of_a_step = (spent - fresh) / counters.iteration
            left = min(left, remaining / of_a_step if of_a_step > 0 else math.inf)
        return max(0.0, left)
