"""The tables of ours, beside the paper's method and a denoiser, and of its parts.

`python -m analysis.learner_table` writes them between markers of README.md and of
docs/learner/README.md, from files of docs/learner: results.csv and minute.csv, which are those of
reports (`ngi report`), the latter on runs of `sweeps/minute`, as are longer.csv and rays.csv, whose
runs of ours had more time and fewer rays per pixel; ablation.csv, which `analysis.parts_plot`
writes of runs of `sweeps/learner`, and frames.json of `ngi benchmark frames`.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.command import errors_in_a_line
from analysis.parts_of_frames import frames_table
from analysis.parts_of_learner import parts_table
from analysis.readme_table import between_markers, markdown_row
from analysis.runs import METRICS

RESULTS = Path("docs/learner/results.csv")
BEGIN, END = "<!-- learner: written by analysis.learner_table -->", "<!-- end of learner -->"

ABLATION = Path("docs/learner/ablation.csv")
OF_PARTS = ("<!-- parts: written by analysis.learner_table -->", "<!-- end of parts -->")
MINUTE = Path("docs/learner/minute.csv")
OF_MINUTE = ("<!-- minute: written by analysis.learner_table -->", "<!-- end of minute -->")
FRAMES = Path("docs/learner/frames.json")
OF_FRAMES = ("<!-- frames: written by analysis.learner_table -->", "<!-- end of frames -->")

METHODS = {
    "ours": "ours",
    "active_exploration": "the paper's method",
    "path_tracing_oidn_8spp": "Open Image Denoise, 8 samples per pixel",
    "path_tracing_oidn": "the same, 1 sample per pixel",
}
"""Columns, from the methods' names in the file."""

VARIANTS = {
    "longer": (Path("docs/learner/longer.csv"), "ours, 300 s"),
    "rays": (Path("docs/learner/rays.csv"), "ours, 8 rays per pixel"),
}
"""What ours of other results is called here: its file and its column, beside `METHODS`."""

PAGES = {
    Path("README.md"): (("mape", "dssim"), list(METHODS)[:3]),
    Path("docs/learner/README.md"): (("mape", "dssim", "mae", "lpips"), list(METHODS)),
}
"""Metrics and methods that each page shows."""


def learner_table(results: pd.DataFrame, metrics: Sequence[str], methods: Sequence[str]) -> str:
    """A row per scene: errors on its hard frames, the lowest of each metric in bold.

    results: the report's table of results; only scenes that have every method are shown
    """
    columns = {**METHODS, **{name: column for name, (_, column) in VARIANTS.items()}}
    heads = ["scene", "seeds", *(columns[method] for method in methods)]
    lines = [markdown_row(heads), markdown_row([":--", "--:", *[":--"] * len(methods)])]
    rows = results.set_index(["scene", "method"])
    for scene in sorted(set(results["scene"])):
        if any((scene, method) not in rows.index for method in methods):
            continue
        errors = pd.DataFrame(
            {m: [rows.loc[(scene, m), f"hard_{metric}"] for metric in metrics] for m in methods}
        ).round(3)
        shown = errors.map(lambda value: f"{value:.3f}")
        shown = shown.where(errors.ne(errors.min(axis=1), axis=0), "**" + shown + "**")
        seeds = len(str(rows.loc[(scene, methods[0]), "seeds"]).split())
        lines.append(markdown_row([scene, str(seeds), *(" / ".join(shown[m]) for m in methods)]))
    return "\n".join(lines)


def written(page: str, results: pd.DataFrame, of: Path) -> str:
    """The page with its table. Raises ValueError where its markers are missing."""
    metrics, methods = PAGES[of]
    table = learner_table(results, metrics, methods)
    return between_markers(page, table, begin=BEGIN, end=END)


def with_parts(page: str, results: pd.DataFrame) -> str:
    """The page with its table of parts. Raises ValueError where its markers are missing."""
    begin, end = OF_PARTS
    return between_markers(page, parts_table(results), begin=begin, end=end)


def with_minute(page: str, results: pd.DataFrame) -> str:
    """The page with the table of a minute's training.

    Raises ValueError where its markers are missing, or a scene has no results of a method.
    """
    methods = list(METHODS)[:3]
    trained = results.groupby("scene")["method"].agg(set)
    for scene, there in trained.items():
        if missing := [method for method in methods if method not in there]:
            raise ValueError(f"{MINUTE}: '{scene}' has no results of {', '.join(missing)}")
    begin, end = OF_MINUTE
    table = learner_table(results, METRICS, methods)
    return between_markers(page, table, begin=begin, end=end)


def with_variant(page: str, results: pd.DataFrame, variant: pd.DataFrame, name: str) -> str:
    """The page with a table of ours, of a variant of it, and of the denoiser.

    variant: a report's table of one method; name: in `VARIANTS`
    Raises ValueError where the table's markers are missing, and where the variant has another
    scene or other seeds than ours.
    """
    runs = variant.dropna(subset="seeds").assign(method=name)  # not the references' noise
    seeds = results[results["method"] == "ours"].set_index("scene")["seeds"]
    for scene, of_variant in zip(runs["scene"], runs["seeds"], strict=True):
        if seeds.get(scene) != of_variant:
            raise ValueError(
                f"{VARIANTS[name][0]}: '{scene}' has seeds {of_variant}, in {RESULTS} "
                f"{seeds.get(scene)}"
            )
    table = learner_table(
        pd.concat([results, runs]), METRICS, ["ours", name, "path_tracing_oidn_8spp"]
    )
    begin = f"<!-- {name}: written by analysis.learner_table -->"
    return between_markers(page, table, begin=begin, end=f"<!-- end of {name} -->")


def with_frames(page: str, benchmark: Mapping[str, Any]) -> str:
    """The page with its table of frames. Raises ValueError where its markers are missing."""
    begin, end = OF_FRAMES
    return between_markers(page, frames_table(benchmark["figures"]), begin=begin, end=end)


@errors_in_a_line
def main() -> int:
    """Entry point; returns the exit status."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    results = pd.read_csv(RESULTS)
    for page in PAGES:
        page.write_text(written(page.read_text(), results, page))
    page = Path("docs/learner/README.md")
    text = with_parts(page.read_text(), pd.read_csv(ABLATION))
    text = with_minute(text, pd.read_csv(MINUTE))
    for name, (file, _) in VARIANTS.items():
        text = with_variant(text, results, pd.read_csv(file), name)
    page.write_text(with_frames(text, json.loads(FRAMES.read_text())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
