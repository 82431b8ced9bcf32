"""What needs no training: path tracing at few samples per pixel, and production denoisers of it."""

from ngi.denoise.denoised_job import DenoisedJob
from ngi.denoise.denoisers import Denoiser, OpenImageDenoise, OptixDenoise, guides
from ngi.denoise.frame_time import FrameTimes, largest_fitting
from ngi.denoise.path_tracing import PathTracing, Plan

__all__ = [
    "DenoisedJob",
    "Denoiser",
    "FrameTimes",
    "OpenImageDenoise",
    "OptixDenoise",
    "PathTracing",
    "Plan",
    "guides",
    "largest_fitting",
]
