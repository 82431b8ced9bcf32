"""Time to equal error as a table: every method against the baseline, on every scene."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.claim_tables import format_time_ratio
from analysis.methods import BASELINE, baselines, methods_in_order, title
from analysis.pairs import pair_by_seed
from analysis.runs import Run
from analysis.speedup import time_ratio
from analysis.tables import Cell, Table


def time_table(runs: Sequence[Run], *, baseline: str = BASELINE) -> Table:
    """How many times as long the baseline takes to the error that both reach; above 1 it is slower.

    The baseline of a scene is the method of this name where that was run, else its first one, with
    the same budget if there is one; scenes of one method have no row.
    """
    rows = []
    for scene in sorted({run.scene for run in runs}):
        of_scene = [run for run in runs if run.scene == scene]
        budgets = {run.method: run.label.get("budget") for run in of_scene}
        in_order = {method: budgets[method] for method in methods_in_order(of_scene)}
        for method, other in baselines(in_order, baseline=baseline):
            if pairs := pair_by_seed(_by_seed(of_scene, method), _by_seed(of_scene, other)):
                ratio = format_time_ratio(time_ratio(pairs))
                rows.append((Cell(scene), Cell(title(method)), Cell(title(other)), Cell(ratio)))
    columns = ("scene", "method", "baseline", "baseline's time / method's time")
    return Table("Run time to equal error", columns, tuple(rows), 3)


def _by_seed(runs: Sequence[Run], method: str) -> dict[int, Run]:
    return {run.seed: run for run in runs if run.method == method}
