"""Runs extreme and stiff cases and says what became of each: `ngi stability --help`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from ngi.config.options import option, run_tool
from ngi.files.durable import write_atomically
from ngi.studies.stability.case import Case, Row, attempt

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass
class StabilityOptions:
    """Runs extreme and stiff cases on every available sampler, precision and backend. Reports for
    each: whether all numbers are finite, the error against the ordinary case or a closed form, what
    the program did about it (guard, clamp, resample, refuse), and the verdict.
    """

    groups: list[str] | None = option("of cases; default: all", None)
    matching: str = option("only cases with this in their names", "")
    output: str = option(
        "folder for stability.csv and .md; for a part of the cases stability_part.*",
        "outputs/stability",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi stability`; 1 where a case failed, 2 for a wrong command."""
    return run_tool(stability, StabilityOptions, "ngi stability", arguments)


def stability(chosen: StabilityOptions) -> int:
    """Prints and writes the table; ValueError where there is no such group or case."""
    from pandas import DataFrame

    from ngi.studies.stability.groups import GROUPS

    names = chosen.groups or [*GROUPS]
    if unknown := sorted(set(names) - set(GROUPS)):
        raise ValueError(f"no group {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    groups = {name: GROUPS[name] for name in names}
    rows = run(groups, matching=chosen.matching)
    if not rows:
        known = ", ".join(case.name for cases in groups.values() for case in cases)
        raise ValueError(f"no case has '{chosen.matching}' in its name; there are {known}")
    table = DataFrame([row.columns() for row in rows])
    folder = Path(chosen.output)
    file = folder / ("stability_part" if chosen.groups or chosen.matching else "stability")
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(file.with_suffix(".csv"), table.to_csv(index=False).encode())
    text = markdown(table)
    write_atomically(file.with_suffix(".md"), text.encode())
    print(text)
    failed = sum(not row.outcome.passed for row in rows)
    print(f"\n{len(rows)} cases, {failed} failed; {file.with_suffix('.csv')}")
    return 1 if failed else 0


def run(groups: Mapping[str, Sequence[Case]], *, matching: str = "") -> list[Row]:
    """A row per case and conditions, of the cases with `matching` in their names."""
    tasks = [
        (group, case, conditions)
        for group, cases in groups.items()
        for case in cases
        if matching in case.name
        for conditions in case.conditions()
    ]
    rows = []
    with tqdm(tasks, unit="case", mininterval=1) as bar:
        for group, case, conditions in bar:
            bar.set_postfix_str(f"{group}: {case.name}")
            rows.append(attempt(group, case, conditions))
    return rows


def markdown(table: DataFrame) -> str:
    """The rows as Markdown, a table per group, without columns that a group leaves empty."""
    parts = []
    for group, rows in table.groupby("group", sort=False):
        shown = rows.drop(columns="group").dropna(axis="columns", how="all")
        for column in ("error", "limit"):
            if column in shown:
                shown[column] = shown[column].map("{:.2g}".format, na_action="ignore")
        shown["finite"] = ["yes" if finite else "NO" for finite in shown["finite"]]
        parts.append(f"### {group}\n\n{shown.fillna('').to_markdown(index=False)}")
    return "\n\n".join(parts)


if __name__ == "__main__":
    sys.exit(main())
