"""Whether a long run grows or slows down: `python -m analysis.endurance RUN`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from analysis.command import errors_in_a_line
from analysis.statistics import LEVEL

QUANTITIES = {
    "resident_bytes": ("main memory", "MiB", 2**-20),
    "allocated_bytes": ("main memory in use", "MiB", 2**-20),
    "open_files": ("open files", "", 1.0),
    "folder_bytes": ("folder", "MiB", 2**-20),
    "steps_per_second": ("steps per second", "", 1.0),
    "steps_per_cpu_second": ("steps per second of processor time", "", 1.0),
}
"""Column: what it is called, its unit, and the factor to it."""

SETTLED = 0.1
"""Part of a run in which caches and the store may still fill."""

COLUMNS = ("quantity", "first quarter", "last quarter", "change per hour", "± (95 %)")


def endurance(folder: Path) -> pd.DataFrame:
    """A row per quantity that is known: its means over first and last quarter, and its trend.

    folder: of a run whose metrics.csv has at least a dozen rows; steps per second are those between
        two rows, those per second of processor time, which other programs hardly change, include an
        evaluation in each. The trend is a least-squares line over wall time without evaluations,
        after the first tenth of it; its interval takes the rows as independent.
    Raises ValueError for a run that is too short to tell.
    """
    history = pd.read_csv(folder / "metrics.csv")
    if lacking := {"step", "wall_seconds", "cpu_seconds"} - set(history):
        raise ValueError(f"{folder / 'metrics.csv'} has no column {sorted(lacking)[0]}")
    if len(history) < 12:
        raise ValueError(
            f"{folder / 'metrics.csv'}: {len(history)} evaluations are too few to see a trend; "
            "train with evaluation.count=48, say"
        )
    steps = history["step"].diff()
    history["steps_per_second"] = steps / history["wall_seconds"].diff()
    processor = history["cpu_seconds"].diff()
    history["steps_per_cpu_second"] = steps / processor.where(processor > 0)  # went on elsewhere
    hours = history["wall_seconds"] / 3600
    settled = history[hours > SETTLED * hours.iloc[-1]]
    rows = []
    for column, (name, unit, factor) in QUANTITIES.items():
        if column not in settled or settled[column].isna().all():
            continue
        known = settled[column].dropna().astype(float) * factor
        values = known.to_numpy()
        slope, half_width = _trend(hours[known.index].to_numpy(), values)
        quarter = max(1, len(values) // 4)
        label = f"{name}, {unit}" if unit else name
        rows.append((label, values[:quarter].mean(), values[-quarter:].mean(), slope, half_width))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _trend(hours: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Slope of the least-squares line and half the width of its 95 % interval."""
    line = stats.linregress(hours, values)
    quantile = stats.t.ppf(0.5 + LEVEL / 2, df=len(hours) - 2)
    return float(line.slope), float(quantile * line.stderr)


@errors_in_a_line
def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `python -m analysis.endurance`."""
    parser = argparse.ArgumentParser(
        prog="python -m analysis.endurance",
        description="Reports how memory, open files, disk and speed changed over a long run.",
    )
    parser.add_argument("run", type=Path, help="a run's folder, which holds metrics.csv")
    folder = parser.parse_args(arguments).run
    print(endurance(folder).to_markdown(index=False, floatfmt=".4g"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
