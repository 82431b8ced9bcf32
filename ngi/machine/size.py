"""How large this machine is: its network, its cores, how it begins a run of a given length."""

import math
import os
from typing import Any

from ngi.machine.precision import trains_on_gpu

SECONDS_PER_BATCH = 15.0
"""Of the budget, for each batch that is rendered before the first is reused."""

MOST_BATCHES = 4
"""Rendered before the first is reused, however long the budget."""

WARMUP_STEPS = 30
"""Of the learning rate, where the budget has room for them."""


def network_width(accelerator: str) -> int:
    """Features of a hidden layer: 512 on a GPU (paper, Sec. 4.2), 128 on a processor.

    accelerator: the trainer's; 'cpu' leaves a GPU out
    """
    return 512 if trains_on_gpu(accelerator) else 128


def network_depth(accelerator: str) -> int:
    """Number of hidden layers: 8 on a GPU (paper, Sec. 4.2), 6 on a processor."""
    return 8 if trains_on_gpu(accelerator) else 6


def usable_cores() -> int:
    """Processor cores that this process may use: fewer than the machine has where it is pinned."""
    return len(os.sched_getaffinity(0))


def bootstrap_batches(seconds: Any) -> int:
    """How many batches are rendered before the first is reused: a share of the budget.

    seconds: of the budget; None for a budget in steps, and anything else is what is refused later
    """
    if not isinstance(seconds, int | float) or not math.isfinite(seconds):
        return MOST_BATCHES
    return max(1, min(MOST_BATCHES, int(seconds / SECONDS_PER_BATCH)))


def warmup_steps(steps: Any) -> int:
    """Over how many steps the learning rate rises: `WARMUP_STEPS`, at most a quarter of the budget.

    steps: of the budget; None for a budget in seconds, and anything else is what is refused later
    """
    return min(WARMUP_STEPS, steps // 4) if isinstance(steps, int) else WARMUP_STEPS
