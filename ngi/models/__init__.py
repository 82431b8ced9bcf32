"""The neural renderer, its loss, and what it says about single samples. PyTorch only."""

from ngi.models.anf import AffinityDenoiser
from ngi.models.cnsr import CNSR
from ngi.models.encoded_generator import EncodedGenerator
from ngi.models.image_layers import ImageLinear
from ngi.models.loss import L1Dssim, SampleLoss
from ngi.models.patch_linear import PatchLinear
from ngi.models.pixel_generator import PixelGenerator
from ngi.models.sample_signals import (
    adam_step_norm,
    output_gradient_norm,
    step_norms_in_backward,
)
from ngi.models.sequence_loss import SequenceSmape

__all__ = [
    "CNSR",
    "AffinityDenoiser",
    "EncodedGenerator",
    "ImageLinear",
    "L1Dssim",
    "PatchLinear",
    "PixelGenerator",
    "SampleLoss",
    "SequenceSmape",
    "adam_step_norm",
    "output_gradient_norm",
    "step_norms_in_backward",
]
