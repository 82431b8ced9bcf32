"""Training patches whose noise a denoiser takes off."""

from __future__ import annotations

from dataclasses import replace

import torch

from ngi.denoise.denoisers import Denoiser, guides
from ngi.patches import BufferLayout
from ngi.render.protocol import RenderedPatches


def denoised(
    traced: RenderedPatches, *, denoiser: Denoiser, traced_share: float, layout: BufferLayout
) -> RenderedPatches:
    """The patches, denoised one by one, on the CPU.

    A denoiser errs in the same way wherever the same detail is seen, so that a network would learn
    its errors. Noise differs from patch to patch, and a network averages over it.

    traced_share: part of the radiance as traced in the mean with the denoised one, from 0 to 1
    """
    radiance, buffers = traced.log_radiance.cpu().expm1(), traced.buffers.cpu()
    clean = torch.stack(
        [
            denoiser(patch, *guides(of_patch, layout))
            for patch, of_patch in zip(radiance, buffers, strict=True)
        ]
    )
    mean = clean.clamp_min(0).lerp(radiance, traced_share)
    half = traced.first_half
    if half is not None:  # of the noise, the traced share is what is left
        change = half.cpu().expm1() - radiance
        half = (mean + traced_share * change).clamp_min(0).log1p()
    return replace(traced, log_radiance=mean.log1p(), first_half=half)
