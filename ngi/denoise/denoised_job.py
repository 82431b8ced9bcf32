"""Training patches whose noise a denoiser takes off."""

from __future__ import annotations

from dataclasses import replace

import torch

from ngi.denoise.denoisers import Denoiser, guides
from ngi.patches import BufferLayout
from ngi.render.protocol import PatchJob, RenderedPatches


class DenoisedJob:
    """The `PatchJob` of another one's patches, denoised one by one when they are asked for.

    A denoiser errs in the same way wherever the same detail is seen, so that a network would learn
    its errors. Noise differs from patch to patch, and a network averages over it.

    traced_share: part of the radiance as traced in the mean with the denoised one, from 0 to 1
    """

    def __init__(
        self, job: PatchJob, denoiser: Denoiser, *, traced_share: float, layout: BufferLayout
    ) -> None:
        self._job = job
        self._denoiser = denoiser
        self._traced_share = traced_share
        self._layout = layout
        self._result: RenderedPatches | None = None

    def done(self) -> bool:
        return self._job.done()

    def result(self) -> RenderedPatches:
        if self._result is None:
            traced = self._job.result()
            radiance, buffers = traced.log_radiance.cpu().expm1(), traced.buffers.cpu()
            denoised = torch.stack(
                [
                    self._denoiser(patch, *guides(of_patch, self._layout))
                    for patch, of_patch in zip(radiance, buffers, strict=True)
                ]
            )
            mean = denoised.clamp_min(0).lerp(radiance, self._traced_share)
            half = traced.first_half
            if half is not None:  # of the noise, the traced share is what is left
                change = half.cpu().expm1() - radiance
                half = (mean + self._traced_share * change).clamp_min(0).log1p()
            self._result = replace(traced, log_radiance=mean.log1p(), first_half=half)
        return self._result
