"""What runs and their folders are called, by what was overridden for them."""

import hashlib
import re

LONGEST = 100
"""Characters; longer names are cut, and told apart by a hash."""


def said_overrides(overrides: str | None) -> str:
    """'sampler=uniform,model.hidden_features=64' in a folder's letters; 'default' for no override.

    Of any length: by these words runs made in one way are told from others.
    """
    name = re.sub(r"[^\w.,=+-]+", "_", (overrides or "").replace("+", "")).strip("_,")
    return name or "default"


def run_name(overrides: str | None) -> str:
    """The same as a folder name, cut where it is too long for one."""
    return shortened(said_overrides(overrides), LONGEST)


def shortened(name: str, longest: int) -> str:
    """The name, or so many of its characters, '-' and eight digits of its hash."""
    if len(name) <= longest:
        return name
    return f"{name[:longest]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def run_group(experiment: str | None, budget: str, clock: str) -> str:
    """The folder of runs that belong together: the experiment, or else the budget.

    Times of two clocks are not compared: counted ones ('model') have a folder of their own.
    """
    group = experiment or budget
    return group if clock == "wall" else f"{group}-{clock}-clock"
