"""What a choice of patches could gain: `python -m analysis.ceiling FOLDER`."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.command import errors_in_a_line
from analysis.files import write
from analysis.runs import METRICS, SETS
from analysis.statistics import (
    Estimate,
    difference_over_scenes,
    mean_of_shared,
    paired_difference,
    shared_columns,
)
from analysis.tables import MISSING, Cell, Table, format_percent, to_markdown

RUN = ["scene", "patches", "steps", "choice", "seed"]
"""Columns that tell the runs of a study apart."""

BASELINE = "uniform"

ERRORS = {
    "hard_error": "hard frames",
    "uniform_error": "uniform frames",
    "hard_tail": "worst 5 % of pixels, hard frames",
    "hard_relmse": "noise-free relMSE, hard frames",
    "uniform_relmse": "noise-free relMSE, uniform frames",
}
"""Columns of a run: geometric means of the four metrics, a tail of log1p radiance, and relMSE
without the references' noise, which runs of before it was measured lack."""

NO_CHOICE = "all patches"
"""Uniform choice of the whole pool: what no unbiased choice of fewer patches can go beyond."""

EVERYWHERE = "all of them"
"""The scenes together, each with the mean over its seeds for its one value."""


def read_runs(folder: Path) -> pd.DataFrame:
    """A row per finished run of `python -m ngi.studies.ceiling` below `folder`.

    Raises ValueError where there is none, and where a run is there twice: runs of two studies, of
    other samples per pixel for one, do not say so in their rows.
    """
    files = sorted(folder.rglob("runs/*.csv"))
    if not files:
        raise ValueError(f"{folder}: no runs of `python -m ngi.studies.ceiling` in it")
    runs = pd.concat(
        [pd.read_csv(file).assign(file=str(file)) for file in files], ignore_index=True
    )
    again = runs[runs.duplicated(RUN, keep=False)]
    if not again.empty:
        first, second = again.sort_values(RUN)["file"].iloc[:2]
        raise ValueError(f"{first} and {second} are the same run; give the folder of one study")
    return _comparable(runs.drop(columns="file"))


def _comparable(runs: pd.DataFrame) -> pd.DataFrame:
    """The same runs; where some lack metrics, `SET_error` is that of those which all have."""
    for frames in SETS:
        metrics = runs.filter(items=[f"{frames}_{name}" for name in METRICS])
        if metrics.isna().any(axis=None):
            runs[f"{frames}_error"] = mean_of_shared(metrics)
    return runs


def metrics_counted(runs: pd.DataFrame) -> str:
    """Of which metrics `SET_error` is the mean, a sentence."""
    found = shared_columns(runs.filter(items=[f"hard_{name}" for name in METRICS]))
    names = [str(name).removeprefix("hard_").upper() for name in found]
    lacking = "" if len(names) == len(METRICS) else "; not all runs have the others"
    return f"The error is the geometric mean of {', '.join(names)}{lacking}."


def diverged_runs(runs: pd.DataFrame) -> list[str]:
    """A sentence that names them, where there are any."""
    lost = runs[_diverged(runs, *SETS)].sort_values(RUN)
    named = [
        f"{run['scene']}, {run['patches']} patches, {run['steps']} steps, {run['choice']}, "
        f"seed {run['seed']}"
        for run in lost[RUN].to_dict("records")
    ]
    return [
        f"{len(named)} run(s) ended with errors that are not finite, and so do means with them: "
        f"{'; '.join(named)}."
    ] * bool(named)


def _diverged(runs: pd.DataFrame, *sets: str) -> pd.Series:
    """Whether the errors on any of these sets are not finite."""
    return ~(runs[[f"{frames}_error" for frames in sets]].abs() < math.inf).all(axis=1)


def differences(runs: pd.DataFrame) -> pd.DataFrame:
    """A row per scene, number of steps and patches, choice and error.

    Columns: these, uniform (mean error of uniform choice), difference (relative, of the choice to
    uniform choice, mean over the seeds that both have), half_width (of its 95 % interval, NaN for
    one seed) and n, of seeds; with a run that diverged the means are not finite. Where there are
    several scenes, `EVERYWHERE` stands for all, whose n is that of scenes. Runs on a scene's most
    patches, where only uniform choice was made of them, are on all of the pool, and the choice
    `NO_CHOICE` for every other number.
    """
    rows = []
    runs = runs.assign(
        pair=pd.MultiIndex.from_frame(runs[["scene", "seed"]]).to_flat_index(),
        most=runs["patches"] == runs.groupby("scene")["patches"].transform("max"),
    )
    errors = [error for error in ERRORS if error in runs]
    everywhere = runs.assign(scene=EVERYWHERE)
    both = pd.concat([runs, everywhere]) if runs["scene"].nunique() > 1 else runs
    for (scene, steps), of_steps in both.groupby(["scene", "steps"], sort=False):
        difference = difference_over_scenes if scene == EVERYWHERE else paired_difference
        compared = set(of_steps.loc[of_steps["choice"] != BASELINE, "patches"])
        everything = of_steps[of_steps["most"] & ~of_steps["patches"].isin(compared)]
        everything = everything.assign(choice=NO_CHOICE)
        for patches in sorted(compared):
            here = pd.concat([of_steps[of_steps["patches"] == patches], everything])
            for choice in [c for c in here["choice"].unique() if c != BASELINE]:
                for error in errors:
                    uniform = _by_pair(here, BASELINE, error)
                    found = difference(uniform, _by_pair(here, choice, error))
                    if found is None:
                        continue
                    rows.append(
                        {
                            "scene": scene,
                            "steps": steps,
                            "patches": patches,
                            "choice": choice,
                            "error": error,
                            "uniform": sum(uniform.values()) / len(uniform),
                            "difference": found.mean,
                            "half_width": found.half_width,
                            "n": found.n,
                        }
                    )
    return pd.DataFrame(rows)


def table(found: pd.DataFrame, error: str) -> Table:
    """Differences to uniform choice in one error, a row per scene, steps and patches."""
    shown = found[found["error"] == error]
    choices = sorted(shown["choice"].unique(), key=lambda name: (name == NO_CHOICE, name))
    rows = []
    groups = shown.groupby(["scene", "steps", "patches"], sort=False)
    for (scene, steps, patches), group in groups:
        by_choice = {row["choice"]: row for row in group.to_dict("records")}
        cells = [_text(by_choice.get(choice)) for choice in choices]
        labels = (scene, f"{steps}", f"{patches}", f"{group['uniform'].iloc[0]:.4f}")
        rows.append(tuple(Cell(str(text)) for text in (*labels, *cells)))
    columns = ("scene", "steps", "patches", "uniform choice", *choices)
    return Table(f"Error on {ERRORS[error]}, against uniform choice", columns, tuple(rows), 1)


def concentration(runs: pd.DataFrame) -> Table:
    """Share of the true error that the worst 5 % of patches hold after uniform choice.

    A row per scene, number of steps and patches; runs that diverged have no share, and do not
    count. Where all patches are equally wrong it is 5 %; the nearer it is, the less there is for a
    choice to find.
    """
    rows = []
    told = runs[runs["choice"] == BASELINE]
    for (scene, steps, patches), group in told.groupby(["scene", "steps", "patches"]):
        shares = group["worst_share"]
        texts = (f"{steps}", f"{patches}", f"{100 * shares.mean():.1f} %", f"{shares.count()}")
        rows.append(tuple(map(Cell, (str(scene), *texts))))
    columns = ("scene", "steps", "patches", "error that the worst 5 % of patches hold", "runs")
    return Table("How concentrated the error is", columns, tuple(rows), 1)


def _by_pair(runs: pd.DataFrame, choice: str, error: str) -> dict[tuple[str, int], float]:
    """Of all runs of a choice that measured this error; not finite where they diverged."""
    chosen = runs[runs["choice"] == choice]
    chosen = chosen[chosen[error].notna() | _diverged(chosen, error.partition("_")[0])]
    return dict(zip(chosen["pair"], chosen[error], strict=True))


def _text(row: dict[Hashable, Any] | None) -> str:
    if row is None:
        return MISSING
    half_width = None if pd.isna(row["half_width"]) else row["half_width"]
    found = Estimate(row["difference"], half_width, int(row["n"]))
    return f"{format_percent(found)} ({found.n})"


@errors_in_a_line
def main(argv: Sequence[str] | None = None) -> int:
    """Writes the tables; returns the exit status, 1 where there is nothing to read."""
    parser = argparse.ArgumentParser(
        prog="python -m analysis.ceiling",
        description="Reports what an oracle gains over uniform choice in the runs of "
        "`python -m ngi.studies.ceiling` below FOLDER: runs.csv, differences.csv, tables.md.",
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--output", metavar="PATH", type=Path, help="default: FOLDER")
    arguments = parser.parse_args(argv)
    runs = read_runs(arguments.folder)
    output = arguments.output or arguments.folder
    output.mkdir(parents=True, exist_ok=True)
    found = differences(runs)
    write(output / "runs.csv", runs.to_csv(index=False, float_format="%.6g"))
    write(output / "differences.csv", found.to_csv(index=False, float_format="%.4g"))
    errors = () if found.empty else found["error"].unique()  # of uniform choice alone
    tables = [*(table(found, error) for error in errors), concentration(runs)]
    told = [metrics_counted(runs), *diverged_runs(runs)]
    text = "\n\n".join([*told, *map(to_markdown, tables)]) + "\n"
    write(output / "tables.md", text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
