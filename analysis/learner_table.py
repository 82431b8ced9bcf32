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

import pandas as pd

from analysis.command import errors_in_a_line
from analysis.files import write
from analysis.parts_of_frames import frames_table
from analysis.parts_of_learner import parts_table
from analysis.readme_table import between_markers, markdown_row
from analysis.runs import METRICS

RESULTS = Path("docs/learner/results.csv")
ABLATION = Path("docs/learner/ablation.csv")
MINUTE = Path("docs/learner/minute.csv")
FRAMES = Path("docs/learner/frames.json")

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

BEFORE = "ours_before"
"""In results.csv: the runs of ours, of an earlier commit, that the variants were compared with."""

PAGE = Path("docs/learner/README.md")
PAGES = {
    Path("README.md"): (("mape", "dssim"), list(METHODS)[:3]),
    PAGE: (METRICS, list(METHODS)),
}
"""Metrics and methods that each page shows; `PAGE` has all other tables, too."""


def learner_table(results: pd.DataFrame, metrics: Sequence[str], methods: Sequence[str]) -> str:
    """A row per scene: errors on its hard frames, the lowest of each metric in bold.

    results: the report's table of results; only scenes that have every method are shown, with the
        number of seeds, of each method where they have not as many
    """
    columns = {**METHODS, **{name: column for name, (_, column) in VARIANTS.items()}}
    columns[BEFORE] = "ours, then"
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
        counts = [str(len(str(rows.loc[(scene, m), "seeds"]).split())) for m in methods]
        seeds = counts[0] if len(set(counts)) == 1 else ", ".join(counts)
        lines.append(markdown_row([scene, seeds, *(" / ".join(shown[m]) for m in methods)]))
    return "\n".join(lines)


def minute_table(results: pd.DataFrame) -> str:
    """Of a minute's training. Raises ValueError where a scene has no results of a method."""
    methods = list(METHODS)[:3]
    trained = results.groupby("scene")["method"].agg(set)
    for scene, there in trained.items():
        if missing := [method for method in methods if method not in there]:
            raise ValueError(f"{MINUTE}: '{scene}' has no results of {', '.join(missing)}")
    return learner_table(results, METRICS, methods)


def variant_table(results: pd.DataFrame, variant: pd.DataFrame, name: str) -> str:
    """Of ours as it was then, of a variant of it, and of the denoiser.

    variant: a report's table of one method; name: in `VARIANTS`
    Raises ValueError where the variant has another scene or other seeds than ours.
    """
    runs = variant.dropna(subset="seeds").assign(method=name)  # not the references' noise
    seeds = results[results["method"] == BEFORE].set_index("scene")["seeds"]
    for scene, of_variant in zip(runs["scene"], runs["seeds"], strict=True):
        if seeds.get(scene) != of_variant:
            raise ValueError(
                f"{VARIANTS[name][0]}: '{scene}' has seeds {of_variant}, in {RESULTS} "
                f"{seeds.get(scene)}"
            )
    methods = [BEFORE, name, "path_tracing_oidn_8spp"]
    return learner_table(pd.concat([results, runs]), METRICS, methods)


def tables(page: Path) -> dict[str, str]:
    """All that is written into a page of `PAGES`, by the name in the markers."""
    results = pd.read_csv(RESULTS)
    found = {"learner": learner_table(results, *PAGES[page])}
    if page == PAGE:
        found["frames"] = frames_table(json.loads(FRAMES.read_text())["figures"])
        for name, (file, _) in VARIANTS.items():
            found[name] = variant_table(results, pd.read_csv(file), name)
        found["minute"] = minute_table(pd.read_csv(MINUTE))
        found["parts"] = parts_table(pd.read_csv(ABLATION))
    return found


def with_tables(text: str, tables: Mapping[str, str]) -> str:
    """A page's text with its tables. Raises ValueError where the markers of one are missing."""
    for name, table in tables.items():
        begin = f"<!-- {name}: written by analysis.learner_table -->"
        text = between_markers(text, table, begin=begin, end=f"<!-- end of {name} -->")
    return text


@errors_in_a_line
def main() -> int:
    """Entry point; returns the exit status."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    for page in PAGES:
        write(page, with_tables(page.read_text(), tables(page)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
