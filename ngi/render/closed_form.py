"""What renderers made of closed formulas share: pixels, seeds, noise; all but the formula."""

from abc import abstractmethod
from hashlib import sha256
from math import sqrt
from typing import TypedDict

import torch
from torch import Tensor

from ngi.patches import BufferLayout, MovingPoints
from ngi.render.protocol import RenderedPatches, Renderer
from ngi.render.tracing import check_states, derive_seed, halved, patch_window, require_positive

GOLDEN_RATIO = (1 + sqrt(5)) / 2


class Sampling(TypedDict, total=False):
    """Arguments of `ClosedFormRenderer` that all formulas have in common."""

    samples_per_pixel: int
    halves: bool
    noise: float


class ClosedFormRenderer(Renderer):
    """A `ngi.render.Renderer` of the unit square, in pure PyTorch; subclasses give the formula.

    Everything is evaluated at pixel centres, so that a patch equals the same pixels of the image.

    dimensions: D, at least 1. patch_size: P. samples_per_pixel: only scales the noise.
    halves: see `ngi.render.mitsuba_renderer.HalvesRenderer`.
    noise: relative standard deviation of the radiance at one sample per pixel, 0 for none.
    layout: which buffers there are.
    formula: name, version and numbers of the formula, for the scene's hash.
    Raises ValueError for numbers out of range.
    """

    description = "closed formulas, PyTorch"
    buffer_samples = 1
    camera_part = slice(0, 0)

    def __init__(
        self,
        *,
        dimensions: int,
        patch_size: int,
        layout: BufferLayout,
        formula: tuple[object, ...],
        samples_per_pixel: int = 1,
        halves: bool = False,
        noise: float = 0.0,
    ) -> None:
        require_positive(
            dimensions=dimensions, patch_size=patch_size, samples_per_pixel=samples_per_pixel
        )
        if not 0 <= noise < float("inf"):
            raise ValueError(f"renderer.noise is {noise}; expected a finite number from 0 up")
        self.layout = layout
        self.dimensions = dimensions
        self.moving_points = MovingPoints.none(dimensions)
        self.patch_size = patch_size
        self.samples_per_pixel = samples_per_pixel
        self.halves = halves
        self._of_each = halved(samples_per_pixel) if halves else samples_per_pixel
        self.noise = noise
        content = (*formula, dimensions, float(noise), layout.names)
        self.scene_hash = sha256(repr(content).encode()).hexdigest()

    @abstractmethod
    def shade(self, scene_vectors: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Buffers [n, h, w, C] and noise-free linear radiance [n, h, w, 3].

        scene_vectors: [n, D] in [0, 1]
        points: [n, h, w, 2], x and y in the unit square
        """

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        check_states(states, self.dimensions)
        P = self.patch_size
        windows = [patch_window(p, patch_size=P, resolution=resolution) for p in states[:, -2:]]
        corners = torch.tensor([(w.x, w.y) for w in windows]).reshape(-1, 2)
        buffers, radiance = self.shade(states[:, :-2], _pixel_centres(corners, P, resolution))
        seeds = [seed, derive_seed(seed, b"second half")] if self.halves else [seed]
        means = [self._noisy_patches(radiance, states, resolution, each) for each in seeds]
        return RenderedPatches(
            buffers=buffers,
            log_radiance=torch.log1p(torch.stack(means).mean(dim=0)),
            repaired=0,
            masked=0,
            paths=len(states) * P * P * self.samples_per_pixel,
            first_half=torch.log1p(means[0]) if self.halves else None,
        )

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        require_positive(samples_per_pixel=samples_per_pixel)
        _, clean = self.whole_image(scene_vector, resolution)
        number = derive_seed(seed, scene_vector.numpy().tobytes(), resolution)
        return self._noisy(clean, samples_per_pixel, number)

    def image_buffers(
        self,
        scene_vector: Tensor,
        *,
        resolution: int,
        samples: int | None = None,  # noqa: ARG002 - of the pixels' centres
    ) -> Tensor:
        buffers, _ = self.whole_image(scene_vector, resolution)
        return buffers

    def pixel_buffers(
        self,
        scene_vector: Tensor,
        pixels: Tensor,
        *,
        resolution: int,
        samples: int | None = None,  # noqa: ARG002 - of the pixels' centres
        caustics: bool = True,  # noqa: ARG002 - there are none
    ) -> Tensor:
        corners = torch.stack([pixels % resolution, pixels // resolution], dim=-1)
        points = _pixel_centres(corners, 1, resolution).view(1, -1, 1, 2)
        buffers, _ = self.shade(scene_vector[None], points)
        return buffers[0, :, 0]

    def cameras(self, scene_vectors: Tensor) -> Tensor:
        return torch.zeros(len(scene_vectors), 6)

    def projections(self, scene_vectors: Tensor) -> Tensor:
        """The image is the unit square."""
        return torch.eye(4).repeat(len(scene_vectors), 1, 1)

    def whole_image(self, v: Tensor, resolution: int) -> tuple[Tensor, Tensor]:
        """Buffers [H, W, C] and noise-free radiance [H, W, 3] of resolution x resolution pixels."""
        require_positive(resolution=resolution)
        check_states(torch.cat([v, v.new_zeros(2)])[None], self.dimensions)
        points = _pixel_centres(torch.zeros(1, 2), resolution, resolution)
        buffers, radiance = self.shade(v[None], points)
        return buffers[0], radiance[0]

    def _noisy_patches(
        self, radiance: Tensor, states: Tensor, resolution: int, seed: int
    ) -> Tensor:
        """[n, P, P, 3] of patches of the noise-free radiance, with each half's samples or all."""
        if self.noise == 0 or len(states) == 0:
            return radiance
        numbers = [derive_seed(seed, state.numpy().tobytes(), resolution) for state in states]
        patches = zip(radiance, numbers, strict=True)
        return torch.stack([self._noisy(clean, self._of_each, number) for clean, number in patches])

    def _noisy(self, radiance: Tensor, samples: int, seed: int) -> Tensor:
        if self.noise == 0:
            return radiance
        generator = torch.Generator().manual_seed(seed)
        error = torch.randn(radiance.shape, generator=generator) * self.noise / sqrt(samples)
        return radiance * (1 + error).clamp(min=0)


def _pixel_centres(corners: Tensor, size: int, resolution: int) -> Tensor:
    """[n, size, size, 2]: x and y in the unit square, from the first pixels [n, 2] on."""
    steps = torch.meshgrid(torch.arange(size), torch.arange(size), indexing="xy")
    return (corners[:, None, None] + torch.stack(steps, -1) + 0.5) / resolution


def spread_points(count: int, dimensions: int) -> Tensor:
    """[count, dimensions]: fixed points in [0, 1), no two alike."""
    index = torch.arange(1.0, count + 1)[:, None]
    return torch.frac(index * torch.arange(1.0, dimensions + 1) * GOLDEN_RATIO)


def spread_weights(quantities: int, variables: int) -> Tensor:
    """[quantities, variables]: irrational weights in [0.5, 1.5), by which quantities differ."""
    return 0.5 + spread_points(quantities, variables)
