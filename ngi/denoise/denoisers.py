"""Production denoisers of path-traced images, and training patches whose noise they take off."""

import os
from dataclasses import replace
from functools import partial
from typing import Protocol

import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.files.extras import install_command
from ngi.patches import BufferLayout
from ngi.render.protocol import RenderedPatches

BORDER = 8
"""Pixels by which a patch is continued for a denoiser, which sees less of what is at an edge.

Mirrored at its edges. Open Image Denoise then leaves 4 to 6 % less error in patches of 32x32, and
15 to 17 % less in those of 16x16, as much as in those of 32x32 without; the next 8 change nothing.
"""

ALL_BUT_PARALLEL = 0.999
"""Length of the mean direction of rays that are so; it is less where some hit nothing."""

QUALITIES = ("high", "balanced", "fast")


class Denoiser(Protocol):
    def __call__(self, radiance: Tensor, albedo: Tensor, normal: Tensor) -> Tensor:
        """Linear RGB radiance [H, W, 3], finite, to the same without noise.

        albedo: [H, W, 3] in [0, 1]; normal: [H, W, 3] in world space, zero where nothing was hit;
        both without noise. All are float32 on the CPU.
        """
        ...


class OpenImageDenoise:
    """Intel's Open Image Denoise, its filter 'RT' for high dynamic range.

    It is told that albedo and normal have no noise, which ours have not (`Renderer.image_buffers`).

    quality: 'high', 'balanced' or 'fast', whose time is a half and a quarter of the best one's

    Raises ValueError for another quality, RuntimeError where the package is not installed.
    """

    def __init__(self, *, quality: str = "high") -> None:
        if quality not in QUALITIES:
            raise ValueError(f"quality: '{quality}': choose one of {', '.join(QUALITIES)}")
        try:
            import pyoidn
        except ModuleNotFoundError as error:
            raise RuntimeError(
                f"this configuration uses Open Image Denoise, which needs {error.name}: "
                f"{install_command('denoise')}"
            ) from error
        # Where several runs share a machine, OMP_NUM_THREADS says which part of it each may take.
        # This library does not read that, and pins threads, those of every run to the same cores.
        if threads := os.environ.get("OMP_NUM_THREADS"):
            os.environ.setdefault("OIDN_NUM_THREADS", threads)
            os.environ.setdefault("OIDN_SET_AFFINITY", "0")
        self._denoise = partial(pyoidn.denoise, hdr=True, clean_aux=True, quality=quality)

    def __call__(self, radiance: Tensor, albedo: Tensor, normal: Tensor) -> Tensor:
        denoised: Tensor = self._denoise(radiance, albedo, normal)
        return denoised


class OptixDenoise:
    """NVIDIA's OptiX denoiser, as Mitsuba offers it, guided by the albedo.

    It takes normals in the camera's space, which the buffers do not have; they are left out.

    Raises RuntimeError, saying what to do, where Mitsuba's CUDA backend does not work.
    """

    def __init__(self) -> None:
        from ngi.machine.backend import cuda_problem

        if (problem := cuda_problem()) is not None:
            raise RuntimeError(f"path_tracing=optix does not work here: {problem}")
        self._size: tuple[int, int] | None = None

    def __call__(self, radiance: Tensor, albedo: Tensor, normal: Tensor) -> Tensor:  # noqa: ARG002
        from ngi.machine.backend import VARIANTS, mi

        mi.set_variant(VARIANTS["cuda"])
        height, width = radiance.shape[:2]
        if self._size != (width, height):
            self._size = (width, height)
            self._denoiser = mi.OptixDenoiser(input_size=self._size, albedo=True)
        denoised = self._denoiser(mi.TensorXf(radiance.numpy()), mi.TensorXf(albedo.numpy()))
        result: Tensor = denoised.torch().cpu()
        return result


def guides(buffers: Tensor, layout: BufferLayout) -> tuple[Tensor, Tensor]:
    """Albedo and world-space normal, [H, W, 3] each, as denoisers take them.

    A buffer that the scene does not carry is constant: an albedo of 1, a normal of 0.
    """
    albedo = torch.ones(*buffers.shape[:2], 3)
    normal = torch.zeros_like(albedo)
    if "albedo" in layout.names:
        albedo = buffers[..., layout.slice("albedo")].clamp(0, 1)
    if "normal" in layout.names:
        stored = buffers[..., layout.slice("normal")]
        hit = (stored != 0).any(dim=-1, keepdim=True)
        normal = torch.where(hit, 2 * stored - _covered(buffers, layout), 0)
    return albedo.contiguous(), normal.contiguous()


def _covered(buffers: Tensor, layout: BufferLayout) -> Tensor:
    """[H, W, 1]: the share of a pixel's rays that hit something; buffers are means, a miss is 0.

    A pixel's rays are all but parallel, so that their mean direction is as long as that share,
    unless specular bounces have led them apart: there it counts as 1.
    """
    covered = torch.ones(*buffers.shape[:2], 1)
    if "outgoing" in layout.names:
        covered = buffers[..., layout.slice("outgoing")].norm(dim=-1, keepdim=True)
    if "throughput" in layout.names:
        bounced = (buffers[..., layout.slice("throughput")] != 1).any(dim=-1, keepdim=True)
        covered = torch.where(bounced, 1, covered)
    return torch.where(covered < ALL_BUT_PARALLEL, covered, 1)


def denoised(
    traced: RenderedPatches, *, denoiser: Denoiser, traced_share: float, layout: BufferLayout
) -> RenderedPatches:
    """The patches, denoised one by one, each with `BORDER` pixels around it, on the CPU.

    A denoiser errs in the same way wherever the same detail is seen, so that a network would learn
    its errors. Noise differs from patch to patch, and a network averages over it.

    traced_share: part of the radiance as traced in the mean with the denoised one, from 0 to 1
    """
    radiance, buffers = traced.log_radiance.cpu().expm1(), traced.buffers.cpu()
    border = min(BORDER, radiance.shape[1] - 1)  # a mirror image has no more
    inner = slice(border, border + radiance.shape[1])
    clean = torch.stack(
        [
            denoiser(patch, *guides(of_patch, layout))[inner, inner]
            for patch, of_patch in zip(
                _continued(radiance, border), _continued(buffers, border), strict=True
            )
        ]
    )
    mean = clean.clamp_min(0).lerp(radiance, traced_share)
    half = traced.first_half
    if half is not None:  # of the noise, the traced share is what is left
        change = half.cpu().expm1() - radiance
        half = (mean + traced_share * change).clamp_min(0).log1p()
    return replace(traced, log_radiance=mean.log1p(), first_half=half)


def _continued(images: Tensor, border: int) -> Tensor:
    """Images [n, P, P, C], continued on every side by so many pixels of their mirror image."""
    planes = F.pad(images.movedim(-1, 1), [border] * 4, mode="reflect")
    return planes.movedim(1, -1).contiguous()
