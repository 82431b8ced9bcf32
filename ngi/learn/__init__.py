"""Where exploration, rendering, reuse and the network meet."""

from ngi.learn.batch import Batch, Counters, Feedback
from ngi.learn.budget import Budget
from ngi.learn.callbacks import SamplerFeedback, callbacks
from ngi.learn.checkpoint import AtomicCheckpointIO, prepare_resume, read_checkpoint
from ngi.learn.clock import PhaseClock, RunClock
from ngi.learn.costs import Component, CostFile, Costs, components
from ngi.learn.datamodule import ExplorationDataModule
from ngi.learn.interruption import Interrupted, Interruption
from ngi.learn.learning_rate import LearningRate
from ngi.learn.model_clock import ModelClock
from ngi.learn.module import IlluminationModule, seeded
from ngi.learn.observation_sets import ObservationSets
from ngi.learn.record_log import RecordLog
from ngi.learn.recorder import Recorder
from ngi.learn.row_log import RowLog
from ngi.learn.run_folder import RunFolder
from ngi.learn.samples import Example, PatchSamples, Samples, patch_example
from ngi.learn.schedule import ConstantRate, Schedule, WarmupStableDecay
from ngi.learn.scorer import Scorer
from ngi.learn.sequences import Sequences
from ngi.learn.step_guard import LARGEST_NORM, StepGuard, gradient_norm
from ngi.learn.stream import TrainingStream
from ngi.learn.target_map import TargetMap
from ngi.learn.tracker import Local, Tracker, WeightsAndBiases
from ngi.reuse import PatchArchive

__all__ = [
    "LARGEST_NORM",
    "AtomicCheckpointIO",
    "Batch",
    "Budget",
    "Component",
    "ConstantRate",
    "CostFile",
    "Costs",
    "Counters",
    "Example",
    "ExplorationDataModule",
    "Feedback",
    "IlluminationModule",
    "Interrupted",
    "Interruption",
    "LearningRate",
    "Local",
    "ModelClock",
    "ObservationSets",
    "PatchArchive",
    "PatchSamples",
    "PhaseClock",
    "RecordLog",
    "Recorder",
    "RowLog",
    "RunClock",
    "RunFolder",
    "SamplerFeedback",
    "Samples",
    "Schedule",
    "Scorer",
    "Sequences",
    "StepGuard",
    "TargetMap",
    "Tracker",
    "TrainingStream",
    "WarmupStableDecay",
    "WeightsAndBiases",
    "callbacks",
    "components",
    "gradient_norm",
    "patch_example",
    "prepare_resume",
    "read_checkpoint",
    "seeded",
]
