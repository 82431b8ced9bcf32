"""The neural renderer, its loss, and what it says about single samples. PyTorch only."""

from ngi.models.averaging import Averaging, exponential_average, no_average
from ngi.models.encoded_generator import EncodedGenerator, LinearEmissionGenerator
from ngi.models.image_layers import ImageLinear
from ngi.models.loss import L1Dssim, SampleLoss
from ngi.models.muon import MuonAdam
from ngi.models.patch_linear import PatchLinear
from ngi.models.pixel_generator import PixelGenerator
from ngi.models.sample_signals import (
    output_gradient_norm,
    sample_step_norm,
    step_norms_in_backward,
)

__all__ = [
    "Averaging",
    "EncodedGenerator",
    "ImageLinear",
    "L1Dssim",
    "LinearEmissionGenerator",
    "MuonAdam",
    "PatchLinear",
    "PixelGenerator",
    "SampleLoss",
    "exponential_average",
    "no_average",
    "output_gradient_norm",
    "sample_step_norm",
    "step_norms_in_backward",
]
