"""How good a network is: protocol, test frames, references, metrics and pictures."""

from ngi.evaluate.evaluation import Comparison, EvaluatedFrame, Evaluation, FrameMetrics
from ngi.evaluate.evaluator import Evaluator
from ngi.evaluate.lpips_metric import Lpips
from ngi.evaluate.metrics import (
    ImageMetrics,
    dssim,
    image_metrics,
    mae,
    mape,
    non_finite_pixels,
    relmse,
    tone_map,
)
from ngi.evaluate.pictures import error_picture
from ngi.evaluate.protocol import METRICS, SETS, EvaluationProtocol, Frame, evaluation_frames
from ngi.evaluate.references import Reference, ReferenceCache, relative_noise

__all__ = [
    "METRICS",
    "SETS",
    "Comparison",
    "EvaluatedFrame",
    "Evaluation",
    "EvaluationProtocol",
    "Evaluator",
    "Frame",
    "FrameMetrics",
    "ImageMetrics",
    "Lpips",
    "Reference",
    "ReferenceCache",
    "dssim",
    "error_picture",
    "evaluation_frames",
    "image_metrics",
    "mae",
    "mape",
    "non_finite_pixels",
    "relative_noise",
    "relmse",
    "tone_map",
]
