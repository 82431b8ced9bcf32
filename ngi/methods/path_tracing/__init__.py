"""What needs no training: path tracing at few samples per pixel, denoised or not."""

from ngi.methods.path_tracing.frame_time import FrameTimes, largest_fitting
from ngi.methods.path_tracing.tracing import PathTracing, Plan

__all__ = ["FrameTimes", "PathTracing", "Plan", "largest_fitting"]
