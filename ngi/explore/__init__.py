"""Active exploration of the data space: chains, proposals, targets, acceptance, resolution.

Tensors only: neither renderer nor network is known here.
"""

from ngi.explore.acceptance import Acceptance, Always, Greedy, Metropolis
from ngi.explore.chains import ChainInfo, ChainState, MarkovChains
from ngi.explore.importance import Importance
from ngi.explore.predicted import PredictedLoss
from ngi.explore.predicted_from_buffers import PredictedFromBuffers
from ngi.explore.proposals import (
    Describe,
    ExponentialPerturbation,
    NormalPerturbation,
    ProposalDistribution,
    Proposals,
    nothing_known,
)
from ngi.explore.resolution import GrowingResolution, ResolutionSchedule
from ngi.explore.sampler import Sampler
from ngi.explore.space_filling import LatinHypercube, Sobol, SobolQuarters
from ngi.explore.targets import Constant as ConstantTarget
from ngi.explore.targets import Loss, LossTimesOutputGradient, LossTimesStep, Signals, Target

__all__ = [
    "Acceptance",
    "Always",
    "ChainInfo",
    "ChainState",
    "ConstantTarget",
    "Describe",
    "ExponentialPerturbation",
    "Greedy",
    "GrowingResolution",
    "Importance",
    "LatinHypercube",
    "Loss",
    "LossTimesOutputGradient",
    "LossTimesStep",
    "MarkovChains",
    "Metropolis",
    "NormalPerturbation",
    "PredictedFromBuffers",
    "PredictedLoss",
    "ProposalDistribution",
    "Proposals",
    "ResolutionSchedule",
    "Sampler",
    "Signals",
    "Sobol",
    "SobolQuarters",
    "Target",
    "nothing_known",
]
