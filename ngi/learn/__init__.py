"""Where exploration, rendering, reuse and the network meet."""

from ngi.clock.budget import Budget
from ngi.clock.costs import Component, CostFile, Costs, components
from ngi.clock.model_clock import ModelClock
from ngi.clock.phase_clock import PhaseClock, RunClock
from ngi.clock.progress import Progress
from ngi.files.run_folder import RunFolder
from ngi.learn.batch import Batch, Feedback
from ngi.learn.callbacks import StepLog, callbacks
from ngi.learn.checkpoint import (
    STREAM,
    AtomicCheckpointIO,
    checkpoint_bytes,
    prepare_resume,
    read_checkpoint,
)
from ngi.learn.datamodule import ExplorationDataModule
from ngi.learn.description import Description, disagreeing_relatively, distances, features
from ngi.learn.interruption import Interrupted, Interruption
from ngi.learn.learning_rate import BaseRates
from ngi.learn.lightning_trackers import MLflow, TensorBoard
from ngi.learn.module import IlluminationModule, seeded
from ngi.learn.outcome import Outcome, Step
from ngi.learn.recorder import Recorder
from ngi.learn.run import Run
from ngi.learn.samples import Example, PatchSamples, Samples, network_of, patch_example
from ngi.learn.schedule import ConstantRate, Schedule, WarmupStableDecay
from ngi.learn.scorer import Scorer
from ngi.learn.step import Learner, training_step
from ngi.learn.step_guard import LARGEST_NORM, StepGuard
from ngi.learn.stream import TrainingStream
from ngi.learn.target_map import TargetMap
from ngi.learn.tracker import Local, Tracker
from ngi.learn.wandb_tracker import WeightsAndBiases

__all__ = [
    "LARGEST_NORM",
    "STREAM",
    "AtomicCheckpointIO",
    "BaseRates",
    "Batch",
    "Budget",
    "Component",
    "ConstantRate",
    "CostFile",
    "Costs",
    "Description",
    "Example",
    "ExplorationDataModule",
    "Feedback",
    "IlluminationModule",
    "Interrupted",
    "Interruption",
    "Learner",
    "Local",
    "MLflow",
    "ModelClock",
    "Outcome",
    "PatchSamples",
    "PhaseClock",
    "Progress",
    "Recorder",
    "Run",
    "RunClock",
    "RunFolder",
    "Samples",
    "Schedule",
    "Scorer",
    "Step",
    "StepGuard",
    "StepLog",
    "TargetMap",
    "TensorBoard",
    "Tracker",
    "TrainingStream",
    "WarmupStableDecay",
    "WeightsAndBiases",
    "callbacks",
    "checkpoint_bytes",
    "components",
    "disagreeing_relatively",
    "distances",
    "features",
    "network_of",
    "patch_example",
    "prepare_resume",
    "read_checkpoint",
    "seeded",
    "training_step",
]
