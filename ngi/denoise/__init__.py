"""Production denoisers of path-traced images, and training patches whose noise they take off."""

from ngi.denoise.denoisers import Denoiser, OpenImageDenoise, OptixDenoise, denoised, guides

__all__ = ["Denoiser", "OpenImageDenoise", "OptixDenoise", "denoised", "guides"]
