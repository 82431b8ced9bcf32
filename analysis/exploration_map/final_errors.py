"""Errors at the end of the map's runs: `python -m analysis.exploration_map.final_errors FOLDER`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from analysis.command import errors_in_a_line
from analysis.exploration_map.heat_maps import cell_text
from analysis.exploration_map.runs import BASE, OWN, SAMPLERS, SETTING, UNIFORM, read_table
from analysis.exploration_map.speedup import Comparison
from analysis.exploration_map.tables import knobs_of, setting_name
from analysis.files import write
from analysis.statistics import estimate, paired_difference
from analysis.tables import Cell, Table, format_estimate, format_percent, to_markdown

NAMES = {
    UNIFORM: "uniform",
    OWN: "uniform, reuse as here",
    **SAMPLERS,
    "known": "a tenth in the pockets",
    "known_weighted": "the same, weighted back",
}

COLUMNS = {
    "lit": "rare samples",
    "error_tail": "tail error",
    "error_uniform": "mean error",
    "error_dark": "of it on frames without the rare",
    "false_light": "light seen there",
}
"""Of the map's table, and what is shown where a column is in it."""

TIMES = ("time to the same tail, uniform / this", "time to the same mean, uniform / this")
COMPARED = {"error_tail": "tail, to uniform", "error_uniform": "mean, to uniform"}


def final_errors(table: pd.DataFrame) -> Table:
    """A row per setting, length, kind of reuse and sampler: means over seeds with their interval.

    Differences to uniform sampling are relative and paired by seed. Ratios of run times are those
    of `analysis.exploration_map.speedup` at the base's costs; there is none for samplers that know
    where the rare is.
    """
    shown = {name: title for name, title in COLUMNS.items() if name in table}
    rows = []
    for (*knobs, reuse), whole in table.groupby([*SETTING, "reuse"], sort=False):
        group = whole[whole["step"] == whole["step"].max()]
        setting = setting_name(knobs_of(knobs))
        for sampler in (name for name in NAMES if name in set(group["sampler"])):
            runs = group[group["sampler"] == sampler]
            labels = (setting, str(runs["step"].iloc[0]), "yes" if reuse else "no", NAMES[sampler])
            means = [format_estimate(estimate(runs[name].tolist())) for name in shown]
            ratios = [_difference(group, sampler, name) for name in COMPARED]
            ratios += [_time(whole, sampler, name) for name in COMPARED]
            rows.append(tuple(map(Cell, (*labels, str(len(runs)), *means, *ratios))))
    columns = (
        "setting",
        "steps",
        "reuse",
        "sampler",
        "n",
        *shown.values(),
        *COMPARED.values(),
        *TIMES,
    )
    return Table("Errors at the end", columns, tuple(rows), 4)


def against(table: pd.DataFrame, other: pd.DataFrame) -> pd.DataFrame:
    """The table with another one's uniform sampling to compare with, and its own beside it.

    Raises ValueError where the other one lacks a setting, a kind of reuse or a seed, and where its
    runs are not as long.
    """
    lengths = [int(of["step"].max()) for of in (table, other)]
    if lengths[0] != lengths[1]:
        raise ValueError(f"runs of {lengths[0]} steps cannot be compared with runs of {lengths[1]}")
    keys = [*SETTING, "reuse", "seed"]
    wanted = table[keys].drop_duplicates()
    uniform = other[other["sampler"] == UNIFORM].merge(wanted, on=keys)
    known = {*uniform[keys].itertuples(index=False, name=None)}
    for *knobs, reuse, seed in wanted.itertuples(index=False, name=None):
        if (*knobs, reuse, seed) not in known:
            raise ValueError(
                f"no uniform sampling to compare with: {setting_name(knobs_of(knobs))}, "
                f"{'with' if reuse else 'without'} reuse, seed {seed}"
            )
    return pd.concat([uniform, table.replace({"sampler": {UNIFORM: OWN}})], ignore_index=True)


def _difference(runs: pd.DataFrame, sampler: str, error: str) -> str:
    if sampler == UNIFORM:
        return ""
    uniform, other = (
        dict(zip(of["seed"], of[error], strict=True))
        for of in (runs[runs["sampler"] == name] for name in (UNIFORM, sampler))
    )
    return format_percent(paired_difference(uniform, other))


def _time(rows: pd.DataFrame, sampler: str, error: str) -> str:
    if sampler not in (OWN, *SAMPLERS):
        return ""
    reuse = bool(rows["reuse"].iloc[0])
    found = Comparison(rows, sampler, reuse, BASE["cost_ratio"], error).speedup()
    return cell_text(dict(asdict(found).items()))


@errors_in_a_line
def main(argv: Sequence[str] | None = None) -> int:
    """Writes the table; returns the exit status, 1 where there is nothing to read."""
    parser = argparse.ArgumentParser(
        prog="python -m analysis.exploration_map.final_errors",
        description="Errors at the end of all runs that `python -m ngi.studies.exploration_map` "
        "left in the FOLDERs, as one table per folder.",
    )
    parser.add_argument("folders", metavar="FOLDER", type=Path, nargs="+")
    parser.add_argument("--output", metavar="FILE", type=Path, required=True, help="Markdown")
    parser.add_argument(
        "--against",
        metavar="FOLDER",
        type=Path,
        help="folder whose uniform sampling is the baseline; by default each folder's own",
    )
    arguments = parser.parse_args(argv)
    runs = [read_table(folder) for folder in arguments.folders]
    if arguments.against is not None:
        runs = [against(table, read_table(arguments.against)) for table in runs]
    tables = [final_errors(table) for table in runs]
    text = "\n\n".join(map(to_markdown, tables)) + "\n"
    write(arguments.output, text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
