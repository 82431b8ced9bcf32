"""What a run logged at every training step, brought to few points that seeds share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.run_checks import read_table
from analysis.runs import Run

COLUMNS = (
    "large_step_acceptance_rate",
    "small_step_acceptance_rate",
    "reuse_probability",
    "loss_new",
    "loss_existing",
    "store_size",
    "store_mean_age",
)
"""Of steps.csv, that tables and figures are made of."""


def read_steps(run: Run) -> pd.DataFrame:
    """A row per training step; NaN in columns of `COLUMNS` that the run did not log.

    Raises ValueError where steps.csv is missing or damaged.
    """
    try:
        steps = read_table(run.folder / "steps.csv")
    except ValueError as error:
        raise ValueError(f"{run.folder}: {error}; move the run away") from error
    return steps.reindex(columns=[*dict.fromkeys([*steps, *COLUMNS])])


def mean_over_time(
    logs: Sequence[pd.DataFrame], column: str, *, points: int = 40
) -> tuple[np.ndarray, np.ndarray]:
    """Run time in seconds [points] and the mean of a column, [runs, points], in equal intervals.

    The intervals share the run time that all runs cover. NaN where a run logged nothing.
    """
    end = min(log["run_seconds"].max() for log in logs)
    edges = np.linspace(0, end, points + 1)
    values = []
    for log in logs:
        interval = pd.cut(log["run_seconds"], list(edges), labels=False)
        values.append(log[column].groupby(interval).mean().reindex(range(points)).to_numpy(float))
    return (edges[1:] + edges[:-1]) / 2, np.stack(values)
