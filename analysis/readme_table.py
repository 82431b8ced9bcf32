"""The tables of claims in README.md and docs/results.md, from those that reports have written.

`python -m analysis.readme_table RESULTS.md … PAGE.md` writes between the page's markers. A page
with the marker of verdicts gets one table, claims by learner; any other those tables of tests that
the reports have runs of, with the paper's learner, with ours, or both. A claim that several
reports have runs of is the first one's.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from analysis.claims import CLAIMS
from analysis.command import errors_in_a_line
from analysis.evidence import Verdict
from analysis.files import write

BEGIN = "<!-- claims: written by analysis.readme_table -->"
BEGIN_WITH_OURS = "<!-- claims with ours: written by analysis.readme_table -->"
BEGIN_VERDICTS = "<!-- verdicts: written by analysis.readme_table -->"
END = "<!-- end of claims -->"

HEADING = "**Claims of the paper**"


def claim_lines(results: str) -> list[dict[str, str]]:
    """Rows of the report's table of claims, by the table's columns.

    results: content of results.md. Raises ValueError where it has no such table.
    """
    _, found, rest = results.partition(HEADING)
    if not found:
        raise ValueError(f"there is no table '{HEADING}': write the report again")
    lines = [line for line in rest.split("\n\n")[1].splitlines() if line.startswith("|")]
    rows = [[cell.strip().replace("\\", "") for cell in line.split("|")[1:-1]] for line in lines]
    return [dict(zip(rows[0], row, strict=True)) for row in rows[2:]]


def judged_claims(*results: str) -> dict[str, dict[str, str]]:
    """By the claim's id, the first line of its evidence, which has the verdict on all of it.

    results: contents of results.md; a claim that several have runs of is the first one's
    """
    judged: dict[str, dict[str, str]] = {}
    for line in (line for report in results for line in claim_lines(report)):
        if line["of the claim"]:
            judged.setdefault(line["claim"], line)
    return judged


def readme_table(*results: str, with_ours: bool = False) -> str:
    """A row per claim that has runs: its primary test, where that was run, and the verdict on all.

    with_ours: of the claims judged with our learner, not of those judged with the paper's. Without
    such runs the text is empty.
    """
    judged, rows = judged_claims(*results), []
    for claim in CLAIMS:
        if claim.with_ours == with_ours and claim.id in judged:
            line = judged[claim.id]
            shown = shown_verdict(line)
            primary = line["test"] == "primary"
            test = (line["compared"], line["difference"]) if primary else ("not run", "")
            rows.append(markdown_row((claim.title, *test, shown)))
    heading = [
        "| claim of the paper | primary test | difference (95 %) | verdict |",
        "|:--|:--|--:|:--|",
    ]
    return "\n".join(heading + rows) if rows else ""


def verdict_table(*results: str) -> str:
    """A row per claim of the paper: the verdicts on it with the paper's learner and with ours."""
    judged = judged_claims(*results)
    rows = [
        markdown_row(
            (
                claim.title,
                *(shown_verdict(judged.get(f"{learner}{claim.id}")) for learner in ("", "ours_")),
            )
        )
        for claim in CLAIMS
        if not claim.with_ours
    ]
    heading = ["| claim of the paper | the paper's learner | with ours |", "|:--|:--|:--|"]
    return "\n".join(heading + rows)


def shown_verdict(line: dict[str, str] | None) -> str:
    """Bold where it decides; line: the first of a claim's evidence, None where nothing has run."""
    if line is None:
        return "not run"
    verdict = line["of the claim"]
    return verdict if verdict == Verdict.INCONCLUSIVE else f"**{verdict}**"


def markdown_row(cells: Iterable[str]) -> str:
    """A line of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def with_tables(page: str, *results: str) -> str:
    """The page with the tables that `results` have runs of; the others stay as they are.

    Raises ValueError where markers are missing.
    """
    if BEGIN_VERDICTS in page:
        return between_markers(page, verdict_table(*results), begin=BEGIN_VERDICTS, end=END)
    for begin, with_ours in ((BEGIN, False), (BEGIN_WITH_OURS, True)):
        if table := readme_table(*results, with_ours=with_ours):
            page = between_markers(page, table, begin=begin, end=END)
    return page


def between_markers(page: str, table: str, *, begin: str, end: str) -> str:
    """The page with the table between these two lines. Raises ValueError where they are missing."""
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(page):
        raise ValueError(f"page: put the lines '{begin}' and '{end}' where the table belongs")
    return pattern.sub(lambda _: f"{begin}\n\n{table}\n\n{end}", page)


@errors_in_a_line
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status."""
    arguments = sys.argv[1:] if argv is None else argv
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    *results, page = map(Path, arguments)
    reports = [report.read_text() for report in results]
    write(page, with_tables(page.read_text(), *reports))
    return 0


if __name__ == "__main__":
    sys.exit(main())
