"""Entry point: `python -m ngi.studies.exploration_map --help`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ngi.studies.exploration_map.plan import PLANS


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the map; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m ngi.studies.exploration_map",
        description="When does exploration pay? Trains every sampler, target and acceptance rule, "
        "with and without reuse, on closed-form scenes with a knob for each cause, and writes "
        "exploration_map.csv. Resumes where it was interrupted. "
        "`python -m analysis.exploration_map FOLDER` draws the map of --settings full; "
        "`python -m analysis.exploration_map.final_errors` has the errors of the others.",
    )
    parser.add_argument(
        "--output", metavar="FOLDER", type=Path, default=Path("outputs/exploration-map")
    )
    parser.add_argument(
        "--settings",
        choices=PLANS,
        default="full",
        help="default: full; ours: uniform sampling and predicted losses with our learner; "
        "ours_long: the same in 4,000 steps, predicting losses without noise; "
        "ours_by_loss: as ours_long, stored patches drawn by loss; "
        "ours_eager: as ours_by_loss, only predicted losses with hardly any bound; "
        "ours_longer, ours_eager_longer: uniform sampling and those in 16,000 steps, where 4,000 "
        "are too few; "
        "ours_chains: as ours_long, greedy chains with the paper's steps and with larger ones; "
        "known_…: with a sampler that knows where the rare effects are, over so many steps",
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4], metavar="SEED")
    parser.add_argument(
        "--jobs", type=int, default=2, help="processes, one thread each (default: 2)"
    )
    arguments = parser.parse_args(argv)

    from ngi.studies.exploration_map.campaign import run_all  # PyTorch takes seconds

    try:
        table = run_all(
            PLANS[arguments.settings],
            seeds=arguments.seeds,
            folder=arguments.output,
            jobs=arguments.jobs,
        )
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"Written: {table}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
