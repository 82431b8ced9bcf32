"""Everything about the runs below a folder, as files and as one page: what `ngi report` writes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from analysis.claim_tables import claims_table
from analysis.dimensions_plot import write_dimensions_figures
from analysis.doubts import comparison_warnings
from analysis.evidence import Verdict
from analysis.exploration import exploration_table
from analysis.exploration_plots import write_exploration_figures
from analysis.files import write
from analysis.films import film_tables
from analysis.frame_times import frame_table
from analysis.latex import to_latex
from analysis.methods import (
    BASELINE,
    differing_fields,
    is_baseline,
    methods_in_order,
    name_methods,
    title,
)
from analysis.page import PageContents, write_page
from analysis.pairs import ways_left_out
from analysis.pictures import write_comparisons
from analysis.plots import method_styles, write_error_curves
from analysis.provenance import provenance_frame
from analysis.runs import SETS, Run, check_comparable, find_runs
from analysis.summary import REFERENCE_NOISE, Comparison, Summary, compare, summarise, to_frame
from analysis.tables import (
    Table,
    comparison_table,
    cost_table,
    error_table,
    to_markdown,
    to_terminal,
    worst_table,
)
from analysis.target_map import warnings_of_maps
from analysis.verdicts import ClaimResult, judge


@dataclass(frozen=True)
class Report:
    """What was written: the text for the terminal, the files, and warnings."""

    text: str
    files: list[Path]
    warnings: list[str]


def write_report(folder: Path, output: Path, *, baseline: str | None = None) -> Report:
    """Reads every run below `folder` and writes the page, tables, plots, pictures into `output`.

    baseline: what others are compared with, but for the claims; `BASELINE` where None
    Raises ValueError where there is no run, or none of the baseline, and where the runs cannot be
    compared; nothing is written then.
    """
    runs, warnings = find_runs(folder)
    runs = name_methods(runs)
    check_comparable(runs)
    base = _baseline(baseline, runs)
    summaries, styles = summarise(runs), method_styles(runs)
    comparisons, claims = compare(summaries, baseline=base), judge(runs)
    doubts = _doubts(runs, claims)
    notes = _notes(runs, claims, comparisons)
    films, unreadable = film_tables(folder, runs)
    found, rest = claims_table(claims), [frame_table(runs), cost_table(summaries), *films]
    wide = _filled([found, *_of_sets(summaries, comparisons, SETS), *rest])
    narrow = _filled([found, *_by_set(summaries, comparisons), *rest])
    output.mkdir(parents=True, exist_ok=True)
    files = _write_tables(summaries, runs, output)
    files += _write_text(wide, narrow, [*notes, *(f"Warning: {doubt}" for doubt in doubts)], output)
    missing = []
    for scene in _progress(sorted({run.scene for run in runs}), "figures of scenes"):
        of_scene = [run for run in runs if run.scene == scene]
        files += write_error_curves(of_scene, styles, output)
        pictures, lacking = write_comparisons(of_scene, output / "pictures")
        files += pictures
        missing += lacking
    files += write_dimensions_figures(runs, output)
    exploration = write_exploration_figures(runs, styles, output)
    warnings += unreadable + doubts + missing
    contents = PageContents(
        name=folder.resolve().name,
        runs=runs,
        summaries=summaries,
        comparisons=comparisons,
        claims=claims,
        styles=styles,
        notes=notes,
        warnings=warnings,
        exploration_table=exploration_table(runs),
        exploration_files=exploration,
        films=films,
        baseline=base,
    )
    page = output / "index.html"
    write_page(contents, page, lambda parts: _progress(parts, "page"))
    text = [*map(to_terminal, narrow), "\n".join(notes)]
    return Report("\n\n".join(text), [page, *files, *exploration], warnings)


def _doubts(runs: Sequence[Run], claims: Sequence[ClaimResult]) -> list[str]:
    """What makes comparisons, maps and verdicts doubtful, a line each."""
    of_claims = [doubt for claim in claims for doubt in claim.doubts]
    return [*comparison_warnings(runs), *ways_left_out(runs), *warnings_of_maps(runs), *of_claims]


def _baseline(asked_for: str | None, runs: Sequence[Run]) -> str:
    if asked_for is None:
        return BASELINE
    if not any(is_baseline(run.method, baseline=asked_for) for run in runs):
        there = ", ".join(f"'{method}'" for method in methods_in_order(runs))
        raise ValueError(f"--baseline {asked_for}: no run has this method; there are {there}")
    return asked_for


def _progress(parts: Iterable[Any], what: str) -> Iterable[Any]:
    """The parts under a progress bar, where someone looks."""
    return tqdm(parts, desc=what, leave=False, disable=None)


def _of_sets(
    summaries: Sequence[Summary], comparisons: Sequence[Comparison], sets: Sequence[str]
) -> list[Table]:
    """Errors on these sets of frames."""
    errors = [error_table(summaries, sets), worst_table(summaries, sets)]
    return [*errors, comparison_table(comparisons, sets)]


def _by_set(summaries: Sequence[Summary], comparisons: Sequence[Comparison]) -> list[Table]:
    """One set of frames at a time, which fits a terminal and a page."""
    return [table for name in SETS for table in _of_sets(summaries, comparisons, [name])]


def _filled(tables: Iterable[Table]) -> list[Table]:
    return [table for table in tables if table.rows]


def _write_tables(summaries: Sequence[Summary], runs: Sequence[Run], output: Path) -> list[Path]:
    results, provenance = output / "results.csv", output / "provenance.csv"
    write(results, to_frame(summaries).to_csv(index=False))
    write(provenance, provenance_frame(runs).to_csv(index=False))
    return [results, provenance]


def _write_text(
    wide: Sequence[Table], narrow: Sequence[Table], notes: Sequence[str], output: Path
) -> list[Path]:
    """The wide tables and the notes as Markdown, the narrow ones as LaTeX."""
    markdown, latex = output / "results.md", output / "results.tex"
    lines = "\n".join(f"- {note}" for note in notes)
    write(markdown, "\n\n".join([*map(to_markdown, wide), lines]) + "\n")
    package = r"% for documents with \usepackage{booktabs}"
    write(latex, "\n\n".join([package, *map(to_latex, narrow)]) + "\n")
    return [markdown, latex]


def _notes(
    runs: Sequence[Run], claims: Sequence[ClaimResult], comparisons: Sequence[Comparison]
) -> list[str]:
    """How to read the tables, and how the methods differ."""
    protocol = runs[0].result["protocol"]
    notes = [
        f"Protocol {protocol['name']} ({protocol['identity']}). Lower is better; a scene's "
        "lowest mean is marked, however small its lead.",
        "±: half width of the 95 % interval of the mean over n seeds (Student's t); "
        "none for one seed.",
        f"{REFERENCE_NOISE}: what a perfect prediction would score against these references; for "
        "DSSIM and LPIPS a lower bound of the right order of magnitude.",
    ]
    if comparisons:
        notes.append(
            "Relative difference, paired by seed: the arithmetic mean over the seeds. Claims have "
            "the geometric mean of the ratios, which is lower the more these scatter: of ratios of "
            "0.4, 0.9 and 1.8 the arithmetic mean is +3.3 %, their geometric mean -13.5 %."
        )
    if judged := sum(claim.verdict is not Verdict.NOT_RUN for claim in claims):
        notes.append(
            f"Claims judged: {judged}. Only a claim's primary test, named beforehand, can refute "
            "it; it is reproduced if all its tests say so, at 95 % each. There is no correction "
            f"for multiple tests: if all claims were untrue, {0.025 * judged:.2f} of them would be "
            "called reproduced by chance."
        )
    fields = differing_fields(runs)
    for method in methods_in_order(runs):
        label = next(run.label for run in runs if run.method == method)
        if fields:
            chosen = ", ".join(f"{field} {label[field]}" for field in fields)
            notes.append(f"{title(method)}: {chosen}")
    reasons = {run.result["lpips_note"] for run in runs if run.result.get("lpips_note")}
    notes += [f"LPIPS is empty: {reason}" for reason in sorted(reasons)]
    return notes
