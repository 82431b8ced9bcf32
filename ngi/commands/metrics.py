"""Recomputes runs' metrics from their linear pictures, and compares: `ngi metrics --help`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tabulate import tabulate

from ngi.config.options import option, run_tool
from ngi.evaluate import METRICS, SETS, Lpips
from ngi.evaluate.evaluation import mean
from ngi.evaluate.recompute import Frames, differences, recomputed


@dataclass
class MetricsOptions:
    """Recomputes the metrics of finished runs from the predictions and references in their
    folders (linear/*.exr), and compares them with result.json, frame by frame. Nothing but the
    run's folder is needed, for LPIPS AlexNet's weights too. Exit status 1 where something differs,
    2 where a run cannot be checked.

    ngi metrics run=outputs/demo
    """

    run: str = option("folder of a run, or any folder with runs below it")
    lpips_weights: str | None = option(
        "AlexNet's; none: $NGI_LPIPS_WEIGHTS or PyTorch's cache", None
    )


def _table(result: Mapping[str, Any], frames: Frames) -> str:
    rows = []
    for set_name in SETS:
        for name in METRICS:
            told = result["metrics"][set_name][name]
            values = [f[name] for f in frames if f["set"] == set_name]
            found = None if None in values else mean(values)
            rows.append([set_name, name, None if told is None else told["mean"], found])
    headers = ["frames", "metric", "result.json", "recomputed"]
    table: str = tabulate(rows, headers, floatfmt=".6g", missingval="–")
    return table


def check(options: MetricsOptions) -> int:
    """Prints what was found; 0 where all agrees, 1 where not, 2 where a run cannot be checked.

    Raises ValueError where there is no run at all, and for weights of LPIPS that are none.
    """
    folder = Path(options.run)
    files = sorted(folder.rglob("result.json"))
    if not files:
        raise ValueError(f"{folder} holds no finished run: no result.json in it or below it")
    lpips = Lpips(weights=options.lpips_weights or os.environ.get("NGI_LPIPS_WEIGHTS"))
    status = 0
    for file in files:
        result = json.loads(file.read_text())
        try:
            frames = recomputed(file.parent, result, lpips=lpips)
        except ValueError as error:
            print(error, file=sys.stderr)
            status = 2
            continue
        print(f"\n{file.parent}, {result['linear']} pictures\n{_table(result, frames)}")
        found = list(differences(result, frames))
        print("\n".join(found) or "all frames agree")
        status = max(status, int(bool(found)))
    if lpips.reason:
        print(f"LPIPS is not checked: {lpips.reason}", file=sys.stderr)
    return status


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi metrics`; the exit status, see `check` and `run_tool`."""
    return run_tool(check, MetricsOptions, "ngi metrics", arguments)
