"""Recomputes runs' metrics from their linear pictures, and compares: `ngi metrics --help`."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ngi.config.options import option, run_tool


@dataclass
class MetricsOptions:
    """Recomputes the metrics of finished runs from the predictions and references in their
    folders (linear/*.exr), and compares them with result.json, frame by frame. Needs only the run's
    folder and, for LPIPS, AlexNet's weights. Exit status 1 if something differs, 2 if a run cannot
    be checked.

    ngi metrics run=outputs/demo
    """

    run: str = option("folder of a run, or any folder with runs below it")
    lpips_weights: str | None = option(
        "file of AlexNet's weights; default: $NGI_LPIPS_WEIGHTS or PyTorch's cache", None
    )


UNREADABLE = (ValueError, LookupError, TypeError, AttributeError, OSError, ArithmeticError)
"""What a result.json that is another program's, or none, may raise."""


def check(options: MetricsOptions) -> int:
    """Prints what was found; 0 where all agrees, 1 where not, 2 where a run cannot be checked.

    Raises ValueError where there is no run at all, and for weights of LPIPS that are none.
    """
    from ngi.commands.recomputed import differences, read_result, recomputed, table
    from ngi.evaluate import Lpips

    folder = Path(options.run)
    files = sorted(folder.rglob("result.json"))
    if not files:
        raise ValueError(f"{folder} holds no finished run: no result.json in it or below it")
    lpips = Lpips(weights=options.lpips_weights or os.environ.get("NGI_LPIPS_WEIGHTS"))
    status = 0
    for file in files:
        try:
            result = read_result(file)
            frames = recomputed(file.parent, result, lpips=lpips)
            shown, found = table(result, frames), list(differences(result, frames))
        except UNREADABLE as error:
            damaged = f"{file} is not a result of this program ({type(error).__name__}: {error})"
            print(error if isinstance(error, ValueError) else damaged, file=sys.stderr)
            status = 2
            continue
        print(f"\n{file.parent}, {result['linear']} pictures\n{shown}")
        print("\n".join(found) or "all frames agree")
        status = max(status, int(bool(found)))
    if lpips.reason:
        print(f"LPIPS is not checked: {lpips.reason}", file=sys.stderr)
    return status


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi metrics`; the exit status, see `check` and `run_tool`."""
    return run_tool(check, MetricsOptions, "ngi metrics", arguments)
