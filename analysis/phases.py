"""What the runs spent their time on: seconds by phase, by the wall clock, and energy."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.methods import methods_in_order, title
from analysis.runs import Run
from analysis.tables import MISSING, Cell, Table

COUNTED_PHASES = ("explore", "render", "reuse", "score", "train", "other")
"""Phases that the run time is the sum of."""

UNCOUNTED_PHASES = ("evaluate", "checkpoint")
"""Phases in which the clock of the run time stands still."""

_PHASES = (*COUNTED_PHASES, *UNCOUNTED_PHASES)


def phase_table(runs: Sequence[Run]) -> Table:
    """Seconds by phase, mean over the seeds of a scene and method.

    Where `budget.clock=model`, the phases and the run time are counted with measured costs; the
    wall seconds beside are what the machine took. Energy is that of the whole run in kilojoules.
    """
    rows = []
    for scene in sorted({run.scene for run in runs}):
        of_scene = [run for run in runs if run.scene == scene]
        for method in methods_in_order(of_scene):
            group = [run for run in of_scene if run.method == method]
            clocks = sorted({run.clock for run in group})
            seconds = [[run.result["seconds"].get(phase) for run in group] for phase in _PHASES]
            values = [
                *seconds,
                [run.result["run_seconds"] for run in group],
                [run.result.get("wall_seconds") for run in group],
                [_kilojoules(run) for run in group],
            ]
            cells = [
                Cell(scene),
                Cell(title(method)),
                Cell(str(len(group))),
                Cell(", ".join(clocks)),
            ]
            rows.append((*cells, *(Cell(_mean(numbers)) for numbers in values)))
    columns = (
        *("scene", "method", "n", "clock", *COUNTED_PHASES),
        *(f"{phase} (not counted)" for phase in UNCOUNTED_PHASES),
        *("run seconds", "wall seconds", "energy in kJ"),
    )
    return Table("Seconds by phase", columns, tuple(rows), 2)


def _kilojoules(run: Run) -> float | None:
    joules = run.result.get("energy_joules")
    return None if joules is None else joules / 1000


def _mean(numbers: Sequence[float | None]) -> str:
    known = [number for number in numbers if number is not None]
    return f"{sum(known) / len(known):,.1f}" if len(known) == len(numbers) else MISSING
