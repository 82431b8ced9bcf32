"""Where exploration, rendering, reuse and the network meet."""

from ngi.learn.batch import Batch, Feedback
from ngi.learn.budget import Budget, Seconds, Steps
from ngi.learn.callbacks import callbacks
from ngi.learn.checkpoint import AtomicCheckpointIO, prepare_resume
from ngi.learn.clock import PhaseClock
from ngi.learn.datamodule import ExplorationDataModule
from ngi.learn.module import IlluminationModule, seeded
from ngi.learn.recorder import Recorder
from ngi.learn.row_log import RowLog
from ngi.learn.run_folder import RunFolder
from ngi.learn.scorer import Scorer
from ngi.learn.stream import TrainingStream
from ngi.learn.tracker import Local, Tracker, WeightsAndBiases
from ngi.reuse import PatchArchive

__all__ = [
    "AtomicCheckpointIO",
    "Batch",
    "Budget",
    "ExplorationDataModule",
    "Feedback",
    "IlluminationModule",
    "Local",
    "PatchArchive",
    "PhaseClock",
    "Recorder",
    "RowLog",
    "RunFolder",
    "Scorer",
    "Seconds",
    "Steps",
    "Tracker",
    "TrainingStream",
    "WeightsAndBiases",
    "callbacks",
    "prepare_resume",
    "seeded",
]
