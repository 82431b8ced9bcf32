"""What a stability case is, and what comes out of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any

SAMPLERS = ("uniform", "mcmc_loss_step", "mcmc_loss", "mcmc_output_gradient", "mcmc_metropolis")
"""Options of the configuration group `sampler`."""

PRECISIONS = ("fp32", "bf16")
"""Options of the configuration group `trainer`."""


@dataclass(frozen=True)
class Conditions:
    """Under which a case is run; None where they can make no difference to it.

    sampler, precision: options of the configuration groups `sampler` and `trainer`
    backend: 'llvm', 'cuda' or 'scalar'
    scene: a scene's name
    """

    sampler: str | None = None
    precision: str | None = None
    backend: str | None = None
    scene: str | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a case came to.

    finite: whether every number that came out is
    error: against the ordinary case or the closed form, None where the case has neither
    limit: the largest error that passes; None where it is only reported
    done: what the program did about it: which guard worked, and how often
    as_expected: whether it did what its documentation says
    """

    finite: bool
    done: str
    error: float | None = None
    limit: float | None = None
    as_expected: bool = True

    @property
    def passed(self) -> bool:
        """Finite, within the limit, and as documented."""
        small = self.limit is None or (self.error is not None and self.error <= self.limit)
        return self.finite and self.as_expected and small


@dataclass(frozen=True)
class Case:
    """One extreme case.

    name: what is extreme
    run: does it; what it raises is a failure of the program
    over: the conditions it is run under, by the fields of `Conditions`
    """

    name: str
    run: Callable[[Conditions], Outcome]
    over: dict[str, tuple[str, ...]]

    def conditions(self) -> Iterator[Conditions]:
        """Every combination."""
        for values in product(*self.over.values()):
            yield replace(Conditions(), **dict(zip(self.over, values, strict=True)))


@dataclass(frozen=True)
class Row:
    """A line of the report."""

    group: str
    case: str
    conditions: Conditions
    outcome: Outcome

    def columns(self) -> dict[str, Any]:
        """As a table shows them."""
        outcome = self.outcome
        return {
            "group": self.group,
            "case": self.case,
            **asdict(self.conditions),
            "finite": outcome.finite,
            "error": outcome.error,
            "limit": outcome.limit,
            "done": outcome.done,
            "verdict": "ok" if outcome.passed else "FAILED",
        }


def attempt(group: str, case: Case, conditions: Conditions) -> Row:
    """Runs it; an exception is the outcome of a case that fails."""
    try:
        outcome = case.run(conditions)
    except Exception as error:  # whatever a case raises, the others are to be run
        outcome = Outcome(
            finite=False, done=f"raised {type(error).__name__}: {error}", as_expected=False
        )
    return Row(group, case.name, conditions, outcome)
