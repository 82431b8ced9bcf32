"""A renderer made of closed formulas, which tests the whole pipeline in seconds."""

from __future__ import annotations

from hashlib import sha256
from math import pi, sqrt

import torch
from torch import Tensor

from ngi.patches import BufferLayout
from ngi.render.protocol import Deferred, RenderedPatches
from ngi.render.render_inputs import check_states, patch_window, require_positive
from ngi.render.tracing import Window, derive_seed

FORMULA_VERSION = 1
"""Counts changes of what the formulas give; part of the scene's hash."""

HARD_FRAMES = 10
GOLDEN_RATIO = (1 + sqrt(5)) / 2

CAMERA = (0.5, 0.5, 1.0)
LAMP_CENTRE, LAMP_RADIUS, LAMP_RADIANCE = (0.15, 0.85), 0.08, 3.0
AMBIENT, SPOT = 0.2, 3.0


class AnalyticRenderer:
    """The `ngi.render.Renderer` of a plane lit by a soft spot, in pure PyTorch.

    The plane is the unit square z = 0. Spot centre, spot size, albedo and roughness are smooth
    functions of v, each of which depends on every component. With an emission buffer there is
    also a small lamp that does not move.

        radiance(p) = albedo(v) * (AMBIENT + SPOT * exp(-|p - c(v)|^2 / (2 r(v)^2))) + lamp(p)

    Everything is evaluated at pixel centres, so a patch equals the same pixels of the image.

    dimensions: D, at least 1. patch_size: P. samples_per_pixel: only scales the noise.
    noise: relative standard deviation of the radiance at one sample per pixel, 0 for none.
    layout: which buffers there are. Raises ValueError for numbers out of range.
    """

    def __init__(
        self,
        *,
        dimensions: int,
        patch_size: int,
        samples_per_pixel: int = 1,
        noise: float = 0.0,
        layout: BufferLayout | None = None,
    ) -> None:
        require_positive(
            dimensions=dimensions, patch_size=patch_size, samples_per_pixel=samples_per_pixel
        )
        if not 0 <= noise < float("inf"):
            raise ValueError(f"renderer.noise is {noise}; expected a finite number from 0 up")
        self.layout = layout or BufferLayout()
        self.dimensions = dimensions
        self.patch_size = patch_size
        self.samples_per_pixel = samples_per_pixel
        self.noise = noise
        content = ("analytic", FORMULA_VERSION, dimensions, float(noise), self.layout.names)
        self.scene_hash = sha256(repr(content).encode()).hexdigest()
        self.description = "closed formulas, PyTorch"
        # Irrational weights in [0.5, 1.5): every quantity depends on every variable, differently.
        quantity, variable = torch.arange(1.0, 8)[:, None], torch.arange(1.0, dimensions + 1)
        self._weights = 0.5 + torch.frac(quantity * variable * GOLDEN_RATIO)

    def warm_up(self) -> None:
        """Nothing is compiled."""

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        """See `ngi.render.Renderer.render_patches`."""
        check_states(states, self.dimensions)
        P = self.patch_size
        buffers = torch.empty(len(states), P, P, self.layout.channels)
        radiance = torch.empty(len(states), P, P, 3)
        for i, state in enumerate(states):
            window = patch_window(state[-2:], patch_size=P, resolution=resolution)
            buffers[i], clean = self._evaluate(state[:-2], window)
            number = derive_seed(seed, state.numpy().tobytes(), resolution)
            radiance[i] = self._add_noise(clean, self.samples_per_pixel, number)
        return RenderedPatches(
            buffers=buffers,
            log_radiance=torch.log1p(radiance),
            repaired=0,
            masked=0,
            paths=len(states) * P * P * self.samples_per_pixel,
        )

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> Deferred:
        """See `ngi.render.Renderer.start_patches`."""
        return Deferred(lambda: self.render_patches(states, resolution=resolution, seed=seed))

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        """See `ngi.render.Renderer.render_image`."""
        require_positive(samples_per_pixel=samples_per_pixel)
        _, clean = self._whole_image(scene_vector, resolution)
        number = derive_seed(seed, scene_vector.numpy().tobytes(), resolution)
        return self._add_noise(clean, samples_per_pixel, number)

    def image_buffers(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        """See `ngi.render.Renderer.image_buffers`."""
        buffers, _ = self._whole_image(scene_vector, resolution)
        return buffers

    def hard_frames(self) -> Tensor:
        """[10, D]: fixed points spread over the unit hypercube."""
        index = torch.arange(1.0, HARD_FRAMES + 1)[:, None]
        return torch.frac(index * torch.arange(1.0, self.dimensions + 1) * GOLDEN_RATIO)

    def close(self) -> None:
        """Nothing works elsewhere."""

    def _whole_image(self, v: Tensor, resolution: int) -> tuple[Tensor, Tensor]:
        require_positive(resolution=resolution)
        check_states(torch.cat([v, v.new_zeros(2)])[None], self.dimensions)
        return self._evaluate(v, Window(0, 0, resolution, resolution, resolution))

    def _evaluate(self, v: Tensor, window: Window) -> tuple[Tensor, Tensor]:
        """Buffers [h, w, C] and noise-free radiance [h, w, 3]."""
        # In [-1, 1]; the root keeps the frequency in v the same whatever D.
        wave = torch.sin(2 * pi * (self._weights @ v) / sqrt(self.dimensions))
        centre, size = 0.5 + 0.3 * wave[:2], 0.2 + 0.1 * wave[2]
        albedo, roughness = 0.5 + 0.4 * wave[3:6], 0.5 + 0.4 * wave[6:]
        x = (torch.arange(window.width) + window.x + 0.5) / window.resolution
        y = (torch.arange(window.height) + window.y + 0.5) / window.resolution
        point = torch.stack([*torch.meshgrid(x, y, indexing="xy"), torch.zeros(len(y), len(x))], -1)
        distance = (point[..., :2] - centre).square().sum(-1, keepdim=True)
        radiance = albedo * (AMBIENT + SPOT * torch.exp(-distance / (2 * size**2)))
        to_lamp = (point[..., :2] - torch.tensor(LAMP_CENTRE)).norm(dim=-1, keepdim=True)
        lamp = LAMP_RADIANCE * (to_lamp < LAMP_RADIUS).float().expand_as(point)
        if "emission" in self.layout.names:
            radiance = radiance + lamp
        outgoing = torch.nn.functional.normalize(torch.tensor(CAMERA) - point, dim=-1)
        buffers = {
            "position": point,
            "normal": torch.tensor([0.5, 0.5, 1.0]).expand_as(point),
            "outgoing": outgoing,
            "albedo": albedo.expand_as(point),
            "roughness": roughness.expand_as(distance),
            "throughput": torch.ones_like(point),
            "chain_roughness": torch.zeros_like(distance),
            "emission": torch.log1p(lamp),
        }
        return torch.cat([buffers[name] for name in self.layout.names], -1), radiance

    def _add_noise(self, radiance: Tensor, samples: int, seed: int) -> Tensor:
        if self.noise == 0:
            return radiance
        generator = torch.Generator().manual_seed(seed)
        error = torch.randn(radiance.shape, generator=generator) * self.noise / sqrt(samples)
        return radiance * (1 + error).clamp(min=0)
