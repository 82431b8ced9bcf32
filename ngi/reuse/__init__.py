"""Reuse of rendered patches: the store, its checkpoints, and the policies that decide on reuse.

Tensors only: neither renderer nor network is known here.
"""

from ngi.reuse.archive import PatchArchive
from ngi.reuse.compact import CompactPatches
from ngi.reuse.policies import (
    FixedProbability,
    Never,
    PolicyState,
    ReusePolicy,
    SelfTuning,
    UntilFull,
)
from ngi.reuse.store import PatchStore

__all__ = [
    "CompactPatches",
    "FixedProbability",
    "Never",
    "PatchArchive",
    "PatchStore",
    "PolicyState",
    "ReusePolicy",
    "SelfTuning",
    "UntilFull",
]
