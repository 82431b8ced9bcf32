"""Runs extreme and stiff cases and says what became of each: `ngi stability --help`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from ngi.files.durable import write_atomically
from ngi.machine.memory import keep_freed_memory
from ngi.studies.stability.case import Case, Row, attempt


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi stability`; 1 where a case failed, 2 for a wrong command."""
    from ngi.studies.stability.groups import GROUPS

    parser = _parser(GROUPS)
    chosen = parser.parse_args(arguments)
    if unknown := sorted(set(chosen.groups) - set(GROUPS)):
        parser.error(f"no group {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    keep_freed_memory()
    groups = {name: GROUPS[name] for name in chosen.groups or GROUPS}
    rows = run(groups, matching=chosen.matching)
    if not rows:
        names = ", ".join(case.name for cases in groups.values() for case in cases)
        parser.error(f"no case has '{chosen.matching}' in its name; there are {names}")
    table = pd.DataFrame([row.columns() for row in rows])
    file = chosen.output / ("stability_part" if chosen.groups or chosen.matching else "stability")
    chosen.output.mkdir(parents=True, exist_ok=True)
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


def markdown(table: pd.DataFrame) -> str:
    """The rows as Markdown, a table per group, without columns that a group leaves empty."""
    parts = []
    for group, rows in table.groupby("group", sort=False):
        shown = rows.drop(columns="group").dropna(axis="columns", how="all")
        for column in ("error", "limit"):
            if column in shown:
                shown[column] = [f"{x:.2g}" if pd.notna(x) else "" for x in shown[column]]
        shown["finite"] = ["yes" if finite else "NO" for finite in shown["finite"]]
        parts.append(f"### {group}\n\n{shown.fillna('').to_markdown(index=False)}")
    return "\n\n".join(parts)


def _parser(groups: Mapping[str, Sequence[Case]]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ngi stability",
        description="Runs extreme and stiff cases on every sampler, precision and backend at hand "
        "and says of each: whether all numbers are finite, the error against the ordinary case or "
        "a closed form, what was done about it (guard, clamp, resample, refuse), the verdict.",
    )
    parser.add_argument(
        "groups", nargs="*", metavar="group", help=f"of cases, by default all: {', '.join(groups)}"
    )
    parser.add_argument("--matching", default="", help="only cases with this in their names")
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("outputs/stability"),
        help="folder for stability.csv and stability.md, of a part of the cases stability_part.* "
        "(default: %(default)s)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
