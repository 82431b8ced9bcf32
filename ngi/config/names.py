"""Readable folder names for runs, from what the command line changed."""

from __future__ import annotations

import hashlib
import re

LONGEST = 100
"""Characters; longer names are cut, and told apart by a hash."""


def run_name(overrides: str | None) -> str:
    """'sampler=uniform,model.hidden_features=64' as a folder name; 'default' for no override."""
    name = re.sub(r"[^\w.,=+-]+", "_", (overrides or "").replace("+", "")).strip("_,")
    if not name:
        return "default"
    if len(name) <= LONGEST:
        return name
    return f"{name[:LONGEST]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def run_group(experiment: str | None, budget: str, clock: str) -> str:
    """The folder of runs that belong together: the experiment, or else the budget.

    Times of two clocks are not compared: counted ones ('model') have a folder of their own.
    """
    group = experiment or budget
    return group if clock == "wall" else f"{group}-{clock}-clock"
