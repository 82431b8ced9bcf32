"""The map's table: its knobs and methods, and run time counted in costs."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pandas as pd

TABLE = "exploration_map.csv"

KNOBS = {
    "volume": "volume of the rare effects",
    "dimensions": "dimensions",
    "active": "variables that decide on an effect",
    "pockets": "pockets that share the volume",
    "sharpness": "sharpness of the pockets' borders",
    "noise": "noise of the samples (relative sd)",
    "hidden_features": "width of the network",
    "cost_ratio": "cost of rendering a batch, in training steps",
}
"""Every knob of the scenes, the network and the machine, as axes call it."""

BASE = {
    "volume": 0.01,
    "dimensions": 8,
    "active": 4,
    "pockets": 1,
    "sharpness": 0.0,
    "noise": 0.0,
    "hidden_features": 64,
    "cost_ratio": 10.0,
}
"""The point that single knobs are varied from.

A batch of 16 patches costs 3 (sphere-caustic) to 17 (living-room) steps of 8 x 512 to render on
two cores (docs/explanation/speed.md).
"""

SETTING = [knob for knob in KNOBS if knob != "cost_ratio"]
"""The knobs that are columns of the table."""

UNIFORM = "uniform"
OWN = "uniform_here"
"""Uniform sampling of a table whose runs are compared with another one's."""

SAMPLERS = {
    **{
        f"{target}_{rule}": f"{name}, {rule.capitalize() if rule == 'metropolis' else rule}"
        for target, name in (
            ("loss", "loss"),
            ("loss_step", "loss × step"),
            ("output_gradient", "loss × output gradient"),
        )
        for rule in ("greedy", "metropolis")
    },
    "loss_greedy_large_steps": "loss, greedy, 70 % large steps",
    "predicted": "predicted loss",
    "eager": "predicted loss, eager",
}
"""Every sampler that explores, and its name."""

SCORING = {
    **dict.fromkeys(("loss", "loss_greedy_large_steps"), 0.35),
    "output_gradient": 0.4,
    "loss_step": 1.4,
    **dict.fromkeys(("predicted", "eager"), 0.17),  # the same forest, drawn from otherwise
}
"""What scoring 16 proposals and 16 current states costs, in training steps of 8 x 512 in bf16.

Measured on two cores (docs/explanation/speed.md; loss alone by the same benchmark). Predicting the
losses of a batch's candidates takes up to 4 ms (docs/exploration-ceiling), in steps of ours.
"""

COST_RATIOS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Cost of rendering a batch, in training steps."""

TAIL = "error_tail"
ERRORS = {TAIL: "tail error", "error_uniform": "mean error"}
"""Over the worst 5 % of the test frames, a tenth of which are in pockets; and over all v alike."""

CURVE = ["sampler", "reuse", "seed", "step"]


def read_table(folder: Path) -> pd.DataFrame:
    """The rows of every run, one per evaluation. Raises ValueError where there are none."""
    file = folder / TABLE
    if not file.exists():
        raise ValueError(
            f"{file}: there is no such file; python -m ngi.studies.exploration_map writes it once "
            "all its runs are finished"
        )
    table = pd.read_csv(file)
    missing = {*SETTING, *CURVE, "generated_batches", "scored_batches", *ERRORS} - {*table}
    if missing or table.empty:
        raise ValueError(f"{file}: it lacks {sorted(missing) or 'rows'}; run the map again")
    return table


def scoring_cost(sampler: str) -> float:
    """Of one batch, in training steps; nothing for uniform sampling."""
    if sampler in (UNIFORM, OWN):
        return 0.0
    return SCORING[sampler if sampler in SCORING else sampler.rsplit("_", 1)[0]]


def samplers_of(table: pd.DataFrame) -> dict[str, str]:
    """Those of `SAMPLERS` that a table has rows of, in their order."""
    there = set(table["sampler"])
    return {sampler: name for sampler, name in SAMPLERS.items() if sampler in there}


def run_time(rows: pd.DataFrame, *, cost_ratio: float, scoring: float) -> pd.Series:
    """In training steps: every step costs 1, a generated batch `cost_ratio`, a scored `scoring`."""
    return rows["step"] + rows["generated_batches"] * cost_ratio + rows["scored_batches"] * scoring


def at_base(table: pd.DataFrame, free: Collection[str]) -> pd.DataFrame:
    """The rows in which every knob that is not `free` is at the base.

    There cannot be more active variables than dimensions: where these are few and free, all are.
    """
    matches = pd.Series(True, index=table.index)
    for knob, value in BASE.items():
        if knob in free or knob not in table:
            continue
        wanted = table["dimensions"].clip(upper=value) if knob == "active" else value
        matches &= table[knob] == wanted
    return table[matches]
