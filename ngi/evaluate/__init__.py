"""How good a network is: protocol, test frames, references, metrics and pictures."""

from ngi.evaluate.evaluation import Comparison, EvaluatedFrame, Evaluation, FrameMetrics
from ngi.evaluate.evaluator import Evaluator
from ngi.evaluate.frames import Frame, evaluation_frames
from ngi.evaluate.image_metrics import ImageMetrics, image_metrics
from ngi.evaluate.lpips_metric import Lpips
from ngi.evaluate.metrics import dssim, mae, mape, non_finite_pixels, tone_map
from ngi.evaluate.pictures import error_picture
from ngi.evaluate.protocol import METRICS, SETS, EvaluationProtocol
from ngi.evaluate.reference import Reference, relative_noise
from ngi.evaluate.references import ReferenceCache

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
    "tone_map",
]
