"""Path tracing as it would be shown: few samples per pixel, anew in every frame, denoised."""

from dataclasses import dataclass
from itertools import count

import torch
from torch import Tensor

from ngi.denoise.denoisers import Denoiser, guides
from ngi.render.protocol import Renderer
from ngi.render.tracing import derive_seed


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How frames are to be made.

    denoiser: None for none
    samples_per_pixel: None for as many as fit into the time of a frame
    milliseconds: of a frame; None for those of the network of the same configuration

    Raises ValueError for a number that is not positive, and where both numbers are given.
    """

    denoiser: Denoiser | None
    samples_per_pixel: int | None
    milliseconds: float | None

    def __post_init__(self) -> None:
        if self.samples_per_pixel is not None and self.milliseconds is not None:
            raise ValueError(
                f"path_tracing.samples_per_pixel is {self.samples_per_pixel} and "
                f"path_tracing.milliseconds is {self.milliseconds:g}: give one of them"
            )
        for name in ("samples_per_pixel", "milliseconds"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise ValueError(f"path_tracing.{name} is {value:g}: it must be above 0")


class PathTracing:
    """Images of a scene without a network: paths, and a denoiser or none.

    samples_per_pixel: of every frame
    seed: the same seed gives the same sequence of frames. No two frames share their random
        numbers, as in an animation, nor do they share them with a reference.
    """

    def __init__(
        self, *, renderer: Renderer, denoiser: Denoiser | None, samples_per_pixel: int, seed: int
    ) -> None:
        self.renderer = renderer
        self.denoiser = denoiser
        self.samples_per_pixel = samples_per_pixel
        self.pixels_masked = 0
        self._seeds = (derive_seed(b"path tracing", seed, number) for number in count())

    def trace(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        """[H, W, 3] linear radiance of the next frame.

        Pixels that a path made NaN or Inf are black, as a film shows them that leaves such paths
        out, and are counted.
        """
        radiance = self.renderer.render_image(
            scene_vector,
            resolution=resolution,
            samples_per_pixel=self.samples_per_pixel,
            seed=next(self._seeds),
        ).cpu()
        finite = radiance.isfinite().all(dim=-1, keepdim=True)
        self.pixels_masked += int((~finite).sum())
        return radiance.where(finite, 0)

    def denoise(self, radiance: Tensor, buffers: Tensor) -> Tensor:
        """[H, W, 3] linear radiance. buffers: [H, W, C] of the same pixels."""
        if self.denoiser is None:
            return radiance
        return self.denoiser(radiance, *guides(buffers, self.renderer.layout))

    def radiance(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        """[H, W, 3] linear radiance of the next frame, denoised."""
        radiance = self.trace(scene_vector, resolution=resolution)
        if self.denoiser is None:
            return radiance
        buffers = self.renderer.image_buffers(scene_vector, resolution=resolution)
        return self.denoise(radiance, buffers.cpu())

    def test_inputs(self, scene_vector: Tensor, buffers: Tensor) -> tuple[Tensor, ...]:
        """What an `ngi.evaluate.Evaluator` gives to `predict` beside buffers: the next frame."""
        return (self.trace(scene_vector, resolution=len(buffers)),)

    def predict(self, buffers: Tensor, radiance: Tensor) -> Tensor:
        """log1p of a frame, denoised."""
        return torch.log1p(self.denoise(radiance, buffers))
