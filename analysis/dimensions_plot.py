"""How much exploration gains over time in scenes of more and more variables (Fig. 14, Salon)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.claims import CLAIMS, SALONS
from analysis.curves import common_times, finite_points, mean_curve
from analysis.methods import title
from analysis.pairs import pair_runs
from analysis.plots import STYLE, add_legend, draw_band, new_figure, save_figure
from analysis.runs import METRICS, Run
from analysis.tables import TITLES

COMPARED = {
    claim.id: (claim.comparisons[0].better, claim.comparisons[0].worse)
    for claim in CLAIMS
    if claim.id in ("dimensions", "ours_dimensions")
}
"""By the claim's id: the method that explores, and uniform sampling."""


def write_dimensions_figures(runs: Sequence[Run], folder: Path) -> list[Path]:
    """Writes `dimensions` and `ours_dimensions`, .png, .svg, .pdf, of the claims that have runs."""
    files = []
    for claim in claims_with_salons(runs):
        exploration, uniform = map(title, COMPARED[claim])
        with matplotlib.rc_context(STYLE):
            figure = dimensions_figure(runs, METRICS, claim)
            figure.suptitle(
                f"error of {uniform} minus error of {exploration}, hard frames: "
                "above 0 exploration is better (band: 95 % interval)",
                fontsize=10,
            )
            files += save_figure(figure, folder, claim)
    return files


def dimensions_figure(runs: Sequence[Run], metrics: Sequence[str], claim: str) -> Figure:
    """A panel per metric with a curve per scene; above zero exploration has less error.

    claim: of `COMPARED`
    """
    figure = new_figure(3.3 * len(metrics), 3.0)
    panels = figure.subplots(1, len(metrics), squeeze=False)[0]
    for axes, metric in zip(panels, metrics, strict=True):
        _draw(axes, runs, f"hard_{metric}", claim)
        axes.set_title(f"{TITLES[metric]}: difference", fontsize=9, loc="left")
        axes.set_xlabel("run time in seconds")
    add_legend(figure)
    return figure


def claims_with_salons(runs: Sequence[Run]) -> list[str]:
    """The claims of `COMPARED` that at least one of the Salon's variants has runs for."""
    return [claim for claim in COMPARED if salons_of_both(runs, claim)]


def salons_of_both(runs: Sequence[Run], claim: str) -> list[str]:
    """The Salon's variants in which both of a claim's methods have runs of the same seed."""
    return [salon for salon in SALONS if pair_runs(runs, salon, *COMPARED[claim])]


def _draw(axes: Axes, runs: Sequence[Run], key: str, claim: str) -> None:
    salons = salons_of_both(runs, claim)
    colours = matplotlib.colormaps["viridis"](np.linspace(0, 0.85, len(salons)))
    for salon, colour in zip(salons, colours, strict=True):
        pairs = pair_runs(runs, salon, *COMPARED[claim])
        whole = [p for p in pairs if not (p.better.diverged("hard") or p.worse.diverged("hard"))]
        diverged = len(pairs) - len(whole)
        differences = [_difference(pair.better, pair.worse, key) for pair in whole]
        curve = mean_curve(differences, signed=True)
        if curve is not None:
            label = f"{salon} ({diverged} diverged)" if diverged else salon
            draw_band(axes, curve, label=label, color=matplotlib.colors.to_hex(colour))
    axes.axhline(0, color="#666666", linewidth=0.8)


def _difference(better: Run, worse: Run, key: str) -> np.ndarray:
    """[times, 2] run seconds, and the worse run's error minus the better one's.

    They are the better run's evaluations, as far as both runs' times reach and at the ends of that;
    errors between evaluations are interpolated linearly.
    """
    ours, theirs = (finite_points(run, key) for run in (better, worse))
    if not len(ours) or not len(theirs):
        return np.empty((0, 2))
    times = common_times([ours, theirs])
    difference = np.interp(times, *theirs.T) - np.interp(times, *ours.T)
    return np.stack([times, difference], axis=1)
