"""Puts the page together: what `template.html` is given, and the file it makes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from analysis.dimensions_plot import COMPARED, claims_with_salons, dimensions_figure, salons_of_both
from analysis.evidence import Verdict
from analysis.files import write
from analysis.frame_times import frame_table
from analysis.page.images import Illustration, from_figure, from_files
from analysis.page.sections import Styles, claim_section, scene_section
from analysis.phases import phase_table
from analysis.plots import STYLE
from analysis.provenance import machine_table, provenance_table
from analysis.runs import METRICS, Run
from analysis.summary import Comparison, Summary
from analysis.tables import (
    MISSING,
    TITLES,
    Table,
    comparison_table,
    cost_table,
    error_table,
    worst_table,
)
from analysis.time_table import time_table
from analysis.verdicts import ClaimResult

SIGNS = {
    Verdict.REPRODUCED: "✓",
    Verdict.NOT_REPRODUCED: "✗",
    Verdict.INCONCLUSIVE: "?",
    Verdict.NOT_RUN: "–",
}
"""Stand before a verdict's words, so that it is told neither by colour nor by length alone."""

EXPLORATION_CAPTIONS = {
    "exploration_": "acceptance, reuse, the store and the chains' lifetimes over run time",
    "histogram_scene_": "target density over the scene's variables, and where the chains stood",
    "histogram_patch_": "target density over the patch's position, and where the chains stood",
    "distance_": "distance between the chains' histogram and the target density over run time",
}
"""By how the files' names begin; the scene's name follows."""


@dataclass(frozen=True)
class PageContents:
    """What a report has found out.

    name: of the folder that is reported; claims: all of them, those without runs too;
    exploration: what the chains did, a table and its figures' files; no rows, none without chains
    films: how steady networks are in motion; no tables without films
    baseline: the method that others are compared with where it was run
    """

    name: str
    runs: Sequence[Run]
    summaries: Sequence[Summary]
    comparisons: Sequence[Comparison]
    claims: Sequence[ClaimResult]
    styles: Styles
    notes: Sequence[str]
    warnings: Sequence[str]
    exploration_table: Table
    exploration_files: Sequence[Path]
    films: Sequence[Table]
    baseline: str


def write_page(
    contents: PageContents,
    file: Path,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> None:
    """Writes the page. `progress` wraps what is drawn one after the other: scenes, then claims."""
    environment = Environment(
        loader=PackageLoader("analysis.page", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(sign=SIGNS.__getitem__, missing=MISSING)
    environment.tests["verdict"] = set(map(str, Verdict)).__contains__
    # The style sheet is ours and goes into <style>, where nothing would be unescaped again.
    style = Markup(files("analysis.page").joinpath("style.css").read_text())
    template = environment.get_template("template.html")
    write(file, template.render(style=style, **_context(contents, progress)))


def _context(
    contents: PageContents, progress: Callable[[Iterable[Any]], Iterable[Any]]
) -> dict[str, Any]:
    runs, summaries, styles = contents.runs, contents.summaries, contents.styles
    tested = [result for result in contents.claims if result.verdict is not Verdict.NOT_RUN]
    return {
        "contents": contents,
        "scene_sections": [
            scene_section([run for run in runs if run.scene == scene], styles)
            for scene in progress(_distinct(run.scene for run in runs))
        ],
        "claim_sections": [
            claim_section(result, runs, summaries, styles) for result in progress(tested)
        ],
        "claims_without_runs": [r for r in contents.claims if r.verdict is Verdict.NOT_RUN],
        "verdict_counts": Counter(result.verdict for result in tested),
        "scenes": _distinct(run.scene for run in runs),
        "methods": _distinct(run.method for run in runs),
        "seeds": _distinct(run.seed for run in runs),
        "budgets": _distinct(run.label["budget"] for run in runs),
        "errors": error_table(summaries, ["hard"]),
        "further_errors": _further_errors(contents),
        "times": time_table(runs, baseline=contents.baseline),
        "exploration_figures": _exploration_figures(contents.exploration_files),
        "dimensions_figures": _dimensions_figures(runs),
        "costs": [
            table
            for table in (cost_table(summaries), frame_table(runs), phase_table(runs))
            if table.rows
        ],
        "provenance": [provenance_table(runs), machine_table(runs)],
    }


def _distinct(values: Iterable[Any]) -> list[Any]:
    return sorted(set(values))


def _further_errors(contents: PageContents) -> list[Table]:
    summaries = contents.summaries
    tables = [
        worst_table(summaries, ["hard"]),
        error_table(summaries, ["uniform"]),
        worst_table(summaries, ["uniform"]),
    ]
    if contents.comparisons:
        tables.append(comparison_table(contents.comparisons, ["hard"]))
        tables.append(comparison_table(contents.comparisons, ["uniform"]))
    return tables


def _exploration_figures(paths: Sequence[Path]) -> list[Illustration]:
    return [
        from_files(path, path.with_suffix(".svg"), _exploration_caption(path.stem))
        for path in paths
        if path.suffix == ".png"
    ]


def _exploration_caption(name: str) -> str:
    for prefix, caption in EXPLORATION_CAPTIONS.items():
        if name.startswith(prefix):
            return f"{name.removeprefix(prefix)}: {caption}"
    return name


def _dimensions_figures(runs: Sequence[Run]) -> list[Illustration]:
    """A figure per metric, with the paper's learner and with ours, of which there are runs."""
    with matplotlib.rc_context(STYLE):
        return [
            from_figure(
                dimensions_figure(runs, [metric], claim),
                f"{TITLES[metric]} of {COMPARED[claim][1]} minus that of {COMPARED[claim][0]} "
                f"against run time, hard frames of {', '.join(salons_of_both(runs, claim))}",
            )
            for claim in claims_with_salons(runs)
            for metric in METRICS
        ]
