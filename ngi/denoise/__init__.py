"""Production denoisers of path-traced images, and training patches whose noise they take off."""

from ngi.denoise.denoised_job import DenoisedJob
from ngi.denoise.denoisers import Denoiser, OpenImageDenoise, OptixDenoise, guides

__all__ = ["DenoisedJob", "Denoiser", "OpenImageDenoise", "OptixDenoise", "guides"]
