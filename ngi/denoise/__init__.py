"""Production denoisers of path-traced images, and training patches whose noise they take off."""

from ngi.denoise.denoisers import Denoiser, OpenImageDenoise, OptixDenoise, guides
from ngi.denoise.patches import denoised

__all__ = ["Denoiser", "OpenImageDenoise", "OptixDenoise", "denoised", "guides"]
