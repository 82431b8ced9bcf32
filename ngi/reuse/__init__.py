"""Reuse of rendered patches: the store, its checkpoints, what is drawn from it and when.

Tensors only: neither renderer nor network is known here.
"""

from ngi.reuse.archive import PatchArchive
from ngi.reuse.compact import CompactPatches
from ngi.reuse.drawing import ByImportance, DrawingRule, Epochs, Prioritised, ProportionalToLoss
from ngi.reuse.policies import (
    FixedProbability,
    Never,
    PolicyState,
    ReusePolicy,
    SelfTuning,
    UntilFull,
)
from ngi.reuse.reuse import Reuse
from ngi.reuse.store import PatchStore

__all__ = [
    "ByImportance",
    "CompactPatches",
    "DrawingRule",
    "Epochs",
    "FixedProbability",
    "Never",
    "PatchArchive",
    "PatchStore",
    "PolicyState",
    "Prioritised",
    "ProportionalToLoss",
    "Reuse",
    "ReusePolicy",
    "SelfTuning",
    "UntilFull",
]
