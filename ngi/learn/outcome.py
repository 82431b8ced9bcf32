"""What is told of a training step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    """What came of a step.

    loss: mean over the batch, of the weighted losses
    gradient_norm: L2 norm of the whole gradient, before the guard changed it
    """

    loss: float
    gradient_norm: float


class Step:
    """A step that was taken. What came of it is known at once, or a step later."""

    def __init__(self) -> None:
        self._outcome: Outcome | None = None
        self._waiting: list[Callable[[Outcome], None]] = []

    @property
    def outcome(self) -> Outcome:
        """RuntimeError where nobody has looked at it yet."""
        if self._outcome is None:
            raise RuntimeError("the step's outcome is not known yet; `when_known` gives it")
        return self._outcome

    def when_known(self, do: Callable[[Outcome], None]) -> None:
        """Hands it over: now, or as soon as store and policy have learnt of it."""
        if self._outcome is None:
            self._waiting.append(do)
        else:
            do(self._outcome)

    def tell(self, outcome: Outcome) -> None:
        """Makes it known; to be called once."""
        self._outcome = outcome
        for do in self._waiting:
            do(outcome)
