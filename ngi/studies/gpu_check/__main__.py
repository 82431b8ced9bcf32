"""Entry point of `ngi gpu-check`."""

from __future__ import annotations

import argparse
import math
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import ngi.studies.gpu_check
from ngi.studies.gpu_check.item import CutOffError, Item
from ngi.studies.gpu_check.record import Record
from ngi.studies.gpu_check.survival import surviving

LEFT = 3
"""Exit status where the time was up before everything was measured."""


def main(arguments: Sequence[str] | None = None) -> int:
    """0 once everything is measured, 1 where something failed, 3 where more time is needed.

    All of it is measured in a process of its own, and in another one where a library ended that.
    """
    given = sys.argv[1:] if arguments is None else arguments
    parser = _parser()
    chosen = parser.parse_args(given)
    for option, minutes in (
        ("--minutes", chosen.minutes),
        ("--training-minutes", chosen.training_minutes),
    ):
        if not minutes > 0:
            parser.error(f"argument {option}: {minutes:g}: give more than 0")
    end = time.monotonic() + 60 * chosen.minutes

    def command() -> list[str]:
        left = f"--minutes={(end - time.monotonic()) / 60}"
        code = "from ngi.studies.gpu_check.__main__ import check; raise SystemExit(check())"
        return [sys.executable, "-c", code, *given, left]

    return surviving(command, progress=chosen.output)


def check(arguments: Sequence[str] | None = None) -> int:
    """As `main`, in this process."""
    chosen = _parser().parse_args(arguments)
    import torch

    from ngi.files.durable import DamagedError
    from ngi.machine.backend import activate, describe
    from ngi.machine.memory import keep_freed_memory
    from ngi.machine.provenance import provenance
    from ngi.studies.gpu_check.plan import DRY, Sizes, items

    keep_freed_memory()
    if not torch.cuda.is_available() and not chosen.dry_run:
        print(f"PyTorch {torch.__version__} sees no GPU; --dry-run goes through everything without")
        return 1
    about = provenance(backend=describe(activate()))
    machine = about["machine"]
    card = re.sub(r"\W+", "-", str(machine["gpu"] or machine["processor"])).strip("-").lower()
    folder = chosen.output / (f"dry-{card}" if chosen.dry_run else card)
    every = items(
        DRY if chosen.dry_run else Sizes(),
        folder,
        training_seconds=60 * chosen.training_minutes,
    )
    try:
        record = Record(folder, about=about)
    except DamagedError as error:
        print(error, file=sys.stderr)
        return 1
    end = time.monotonic() + 60 * chosen.minutes
    try:
        work(every, record, end=end)
    except KeyboardInterrupt:
        return 130
    left, failed = record.to_do(every), record.failed(every)
    print(f"{len(every) - len(left)} of {len(every)} measured: {record.page}")
    for key, why in failed.items():
        print(f"failed: {key}: {why}")
    return 1 if failed else LEFT if left else 0


def work(items: Sequence[Item], record: Record, *, end: float) -> None:
    """Measures what is not measured yet, as far as the time until `end` goes.

    end: of `time.monotonic`; an item that may take longer is left to the next call
    """
    for item in record.to_do(items):
        left = end - time.monotonic()
        if left <= 0 or (item.seconds > left and not item.goes_on):
            continue
        print(item.key, flush=True)
        record.begin(item)
        try:
            record.done(item, item.measure(left))
        except CutOffError:
            record.cut_off(item)
        except KeyboardInterrupt:  # no crash of the item's
            record.cut_off(item)
            raise
        except Exception as error:  # whatever it is, the others are measured
            record.fail(item, error)
        record.write_page(items)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ngi gpu-check",
        description=ngi.studies.gpu_check.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--dry-run", action="store_true", help="run every check at a tiny size, without a GPU")
    add(
        "--minutes",
        type=float,
        default=math.inf,
        metavar="M",
        help="stop in time; default: no limit",
    )
    add(
        "--training-minutes",
        type=float,
        default=15.0,
        metavar="M",
        help="training time per run; default: 15",
    )
    add("--output", type=Path, default=Path("outputs/gpu-check"), metavar="FOLDER")
    return parser


if __name__ == "__main__":
    sys.exit(main())
