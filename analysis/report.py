"""Everything about the runs below a folder, as files and as one page.

`python -m analysis.report FOLDER`; help waits for neither pandas nor matplotlib.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from analysis.command import errors_in_a_line


@errors_in_a_line
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status, 1 where there is nothing that can be reported."""
    parser = argparse.ArgumentParser(
        prog="ngi report",
        description="Compares every finished run below FOLDER: results.csv, .md and .tex (mean and "
        "95 % interval over seeds), error against run time (.png, .svg, .pdf), comparison pictures "
        "of the hard frames, and index.html, which combines all this with verdicts on the paper's "
        "claims and the provenance of the runs. Refuses to compare runs with different protocols, "
        "scene files or references.",
    )
    parser.add_argument(
        "folder", metavar="FOLDER", type=Path, help="folder to search for result.json"
    )
    parser.add_argument(
        "--output", metavar="PATH", type=Path, help="where to write; by default FOLDER/report"
    )
    parser.add_argument(
        "--baseline",
        metavar="METHOD",
        help="method to compare all others with, for example ours; by default uniform sampling, "
        "if there are runs of it; the claims have baselines of their own",
    )
    parser.add_argument(
        "--wandb",
        metavar="PROJECT",
        help="log the tables at Weights & Biases; see docs/guide/wandb",
    )
    arguments = parser.parse_args(argv)
    from analysis.report_files import write_report

    output = arguments.output or arguments.folder / "report"
    report = write_report(arguments.folder, output, baseline=arguments.baseline)
    print(report.text)
    for warning in report.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print("\nWritten:")
    for file in report.files:
        print(f"  {file}")
    if arguments.wandb is not None:
        from analysis.wandb_report import send

        name = arguments.folder.resolve().name
        try:
            print(f"  {send(report.files, name=name, project=arguments.wandb)}")
        except Exception as error:  # whatever W&B raises: the report itself is written
            print(f"error: Weights & Biases: {error}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
