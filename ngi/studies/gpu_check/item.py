"""What is found out in one go, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ngi.studies.benchmark.figures import Figure


class CutOffError(Exception):
    """The time is up; what was done is on the disk, and the next call goes on from there."""


@dataclass(frozen=True)
class Outcome:
    """figures: measured numbers; notes: what is said in words, a line each."""

    figures: list[Figure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Item:
    """Something to find out.

    measure: of the seconds that are left. Raises CutOffError where they did not do, anything else
        where it fails
    seconds: that it takes at most on a GPU, so that it is not begun too late
    goes_on: it keeps what it has done where it is cut off, and can be begun at any time
    """

    stage: str
    name: str
    measure: Callable[[float], Outcome]
    seconds: float = 120.0
    goes_on: bool = False

    @property
    def key(self) -> str:
        """Its name in the file."""
        return f"{self.stage}/{self.name}" if self.name else self.stage


Entry = dict[str, Any]
"""Of the JSON file: 'begun' times without an end, and 'figures' and 'notes', or 'failure'."""
