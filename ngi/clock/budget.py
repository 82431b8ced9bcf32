"""How long a run trains: a number of steps, or seconds of run time, and by which clock."""

import math

CLOCKS = ("wall", "model")


class Budget:
    """Training ends after `steps` optimiser steps or `seconds` of run time, whichever comes first.

    steps, seconds: at least one of them; None for no such limit. Run time stands still during
        evaluations and checkpoints. A resumed run with a budget in steps ends as an unbroken one.
    clock: what seconds mean: 'wall', those of `PhaseClock`; 'model', those of `ModelClock`, counted
        with the costs that `ngi costs` has measured, whatever else the machine does
    costs: path of the file that holds these costs, for clock 'model'
    Raises ValueError where neither limit is given, for limits that are not positive and for an
    unknown clock.
    """

    def __init__(
        self,
        *,
        steps: int | None = None,
        seconds: float | None = None,
        clock: str = "wall",
        costs: str | None = None,
    ) -> None:
        if steps is None and seconds is None:
            raise ValueError(
                "budget.steps and budget.seconds are both null, so the run would never end; set one"
            )
        if steps is not None and steps < 1:
            raise ValueError(f"budget.steps: {steps}; expected at least 1 step")
        if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
            raise ValueError(f"budget.seconds: {seconds}; expected more than 0")
        if clock not in CLOCKS:
            raise ValueError(f"budget.clock: '{clock}'; expected one of {list(CLOCKS)}")
        if clock == "model" and costs is None:
            raise ValueError(
                "budget.costs: null; the model clock needs the path of the file that "
                "`ngi costs` writes"
            )
        self.steps = steps
        self.seconds = seconds
        self.clock = clock
        self.costs = costs

    @property
    def maximum_steps(self) -> int:
        """Steps after which Lightning stops by itself; -1 for no limit."""
        return -1 if self.steps is None else self.steps

    def fraction(self, *, steps: int, run_seconds: float) -> float:
        """The part of the budget that is used up; 1 or more ends the run."""
        of_steps = 0.0 if self.steps is None else steps / self.steps
        of_seconds = 0.0 if self.seconds is None else run_seconds / self.seconds
        return max(of_steps, of_seconds)
