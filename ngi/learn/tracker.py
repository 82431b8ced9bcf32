"""Where a run can be watched. Local files are the truth; a tracker is a view of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ngi.evaluate import Evaluation

Row = Mapping[str, object]
"""A row of steps.csv or metrics.csv, with its 'step' and 'run_seconds'."""


class Tracker:
    """Watches a run; what it does not answer to passes it by."""

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        """Called once, before training. RuntimeError where its program is not installed."""

    def step(self, row: Row) -> None:
        """A row of steps.csv."""

    def evaluated(self, row: Row, evaluation: Evaluation) -> None:
        """A row of metrics.csv, and what it is the mean of. Run time stands still meanwhile."""

    def finished(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        """The run was finished before: called instead of all others but `finish`."""

    def finish(self, failure: BaseException | None) -> None:
        """Called whatever happens, so that the jobs of a sweep stay apart.

        failure: what ended the run before its end, an `Interrupted` too
        """


class Local(Tracker):
    """The run's own files and nothing else."""
