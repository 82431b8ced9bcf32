"""The parts of the page that repeat: curves and pictures of a scene, and a claim's evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib

from analysis.claim_tables import (
    EvidenceLine,
    effects_table,
    further_effects_table,
    main_evidence,
)
from analysis.methods import methods_in_order, title
from analysis.page.frames import FramePictures, frames_of
from analysis.page.images import Illustration, from_figure
from analysis.pictures import MOST_DIFFERENT
from analysis.plots import LINE_WIDTH, STYLE, ErrorPanel, error_figure, scene_panels
from analysis.runs import METRICS, Run
from analysis.summary import Summary
from analysis.tables import TITLES, Table, error_table, format_number
from analysis.verdicts import ClaimResult

MOST_SCENES_WITH_EVERY_METRIC = 2
"""A claim about more scenes shows one diagram per scene; all of them stand with the scenes."""

Styles = Mapping[str, dict[str, Any]]


@dataclass(frozen=True)
class LegendEntry:
    """A method's line: CSS colour, and dashes as SVG's stroke-dasharray has them ('' for none)."""

    method: str
    colour: str
    dashes: str


@dataclass(frozen=True)
class SceneSection:
    """A scene's diagrams (hard frames; the same over logarithmic time; uniform frames), pictures.

    frames: those in which the methods differ most; empty where pictures are missing
    """

    scene: str
    legend: list[LegendEntry]
    hard: list[Illustration]
    hard_over_log_time: list[Illustration]
    uniform: list[Illustration]
    frames: list[FramePictures]


@dataclass(frozen=True)
class ClaimSection:
    """A claim with its evidence.

    errors: the table of four metrics of its scenes and methods; effects: the differences on hard
    frames; further: differences on uniform frames and on the worst 5 %
    """

    result: ClaimResult
    evidence: list[EvidenceLine]
    errors: Table
    effects: Table
    further: list[Table]
    legend: list[LegendEntry]
    curves: list[Illustration]
    frames: list[FramePictures]


def scene_section(runs: Sequence[Run], styles: Styles) -> SceneSection:
    """Everything about the runs of one scene."""
    return SceneSection(
        scene=runs[0].scene,
        legend=legend(runs, styles),
        hard=_illustrations(scene_panels(runs, "hard"), styles),
        hard_over_log_time=_illustrations(scene_panels(runs, "hard", log_time=True), styles),
        uniform=_illustrations(scene_panels(runs, "uniform"), styles),
        frames=frames_of(runs, MOST_DIFFERENT),
    )


def claim_section(
    result: ClaimResult, runs: Sequence[Run], summaries: Sequence[Summary], styles: Styles
) -> ClaimSection:
    """The evidence for a claim that has runs."""
    compared = {
        (scene, method): None
        for comparison in result.claim.comparisons
        for scene in comparison.scenes
        for method in (comparison.better, comparison.worse)
    }
    of_claim = [run for run in runs if (run.scene, run.label.get("method")) in compared]
    folders = {run.folder for run in of_claim}
    shown = [summary for summary in summaries if {run.folder for run in summary.runs} & folders]
    scenes = dict.fromkeys(scene for scene, _ in compared)
    by_scene = [[run for run in of_claim if run.scene == scene] for scene in scenes]
    by_scene = [group for group in by_scene if group]
    return ClaimSection(
        result=result,
        evidence=main_evidence(result),
        errors=error_table(shown, ["hard"]),
        effects=effects_table(result),
        further=[
            further_effects_table(result, "hard", "_worst5"),
            further_effects_table(result, "uniform", ""),
            further_effects_table(result, "uniform", "_worst5"),
        ],
        legend=legend(of_claim, styles),
        curves=_illustrations(_claim_panels(by_scene), styles),
        frames=[frame for group in by_scene for frame in frames_of(group, 1)],
    )


def _claim_panels(by_scene: Sequence[Sequence[Run]]) -> list[ErrorPanel]:
    every = len(by_scene) <= MOST_SCENES_WITH_EVERY_METRIC
    metrics = METRICS if every else METRICS[:1]
    return [
        ErrorPanel(f"{runs[0].scene}: {panel.title}", runs, panel.set_name, panel.metric)
        for runs in by_scene
        for panel in scene_panels(runs, "hard")
        if panel.metric in metrics
    ]


def legend(runs: Sequence[Run], styles: Styles) -> list[LegendEntry]:
    return [
        LegendEntry(title(method), styles[method]["color"], _dashes(styles[method]["linestyle"]))
        for method in methods_in_order(runs)
    ]


def _dashes(linestyle: Any) -> str:
    """In pixels; those of matplotlib are in line widths."""
    if linestyle == "-":
        return ""
    return " ".join(f"{LINE_WIDTH * length:g}" for length in linestyle[1])


def _illustrations(panels: Sequence[ErrorPanel], styles: Styles) -> list[Illustration]:
    with matplotlib.rc_context(STYLE):
        return [
            from_figure(error_figure([[panel]], styles, legend=False), _in_words(panel))
            for panel in panels
        ]


def _in_words(panel: ErrorPanel) -> str:
    """'MAPE on hard frames of mirror against run time; at the end uniform 0.105, …'."""
    ends = []
    for method in methods_in_order(panel.runs):
        of_method = [run for run in panel.runs if run.method == method]
        values = [run.metric(panel.set_name, panel.metric) for run in of_method]
        known = [value for value in values if value is not None]
        mean = format_number(sum(known) / len(known)) if known else "not measured"
        ends.append(f"{title(method)} {mean}")
    name, scene = TITLES[panel.metric], panel.runs[0].scene
    what = f"{name} on {panel.set_name} frames of {scene} against run time"
    return f"{what}; at the end {', '.join(ends)}"
