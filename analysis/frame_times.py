"""What a frame takes where path tracing stands in the network's place."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from analysis.methods import methods_in_order, title
from analysis.run_checks import FRAME_PARTS
from analysis.runs import Run
from analysis.tables import Cell, Table


def frame_table(runs: Sequence[Run]) -> Table:
    """Samples per pixel and milliseconds of a frame, median over the seeds of scene and method.

    Buffers are part of a network's frame too, and of no frame without a denoiser. Runs that
    trained a network have no row.
    """
    rows = []
    for scene in sorted({run.scene for run in runs}):
        timed = [run for run in runs if run.scene == scene and "frame" in run.result]
        for method in methods_in_order(timed):
            frames = [run.result["frame"] for run in timed if run.method == method]
            values = [
                [frame["samples_per_pixel"] for frame in frames],
                *([frame["milliseconds"][part] for frame in frames] for part in FRAME_PARTS),
            ]
            cells = (Cell(f"{median(numbers):,.4g}") for numbers in values)
            rows.append((Cell(scene), Cell(title(method)), *cells))
    parts = (f"{part}, ms" for part in FRAME_PARTS)
    return Table("Time per frame", ("scene", "method", "spp", *parts), tuple(rows), 2)
