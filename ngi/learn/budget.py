"""How long a run trains: a number of steps, or seconds of run time."""

from __future__ import annotations

import math
from typing import Protocol


class Budget(Protocol):
    """When training is over."""

    maximum_steps: int
    """Steps after which Lightning stops by itself; -1 for no limit."""

    def fraction(self, *, steps: int, run_seconds: float) -> float:
        """The part of the budget that is used up; 1 or more ends the run."""
        ...


class Steps:
    """Trains for `steps` optimiser steps; a resumed run ends as an unbroken one would have."""

    def __init__(self, *, steps: int) -> None:
        if steps < 1:
            raise ValueError(f"budget.steps: {steps} is no budget; expected at least 1 step")
        self.maximum_steps = steps

    def fraction(self, *, steps: int, run_seconds: float) -> float:  # noqa: ARG002
        return steps / self.maximum_steps


class Seconds:
    """Trains for `seconds` of run time (`PhaseClock.run_seconds`): evaluation does not count."""

    maximum_steps = -1

    def __init__(self, *, seconds: float) -> None:
        if not (math.isfinite(seconds) and seconds > 0):
            raise ValueError(f"budget.seconds: {seconds} is no budget; expected more than 0")
        self.seconds = seconds

    def fraction(self, *, steps: int, run_seconds: float) -> float:  # noqa: ARG002
        return run_seconds / self.seconds
