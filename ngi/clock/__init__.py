"""How long a run trains, and by which clock."""

from ngi.clock.budget import Budget
from ngi.clock.costs import Component, CostFile, Costs, components
from ngi.clock.counters import Counters
from ngi.clock.model_clock import ModelClock
from ngi.clock.phase_clock import PAUSES, PHASES, PhaseClock, RunClock

__all__ = [
    "PAUSES",
    "PHASES",
    "Budget",
    "Component",
    "CostFile",
    "Costs",
    "Counters",
    "ModelClock",
    "PhaseClock",
    "RunClock",
    "components",
]
