"""A renderer made of closed formulas, which tests the whole pipeline in seconds."""

from math import pi, sqrt
from typing import Unpack

import torch
from torch import Tensor

from ngi.patches import BufferLayout
from ngi.render.closed_form import ClosedFormRenderer, Sampling, spread_points, spread_weights

FORMULA_VERSION = 1
"""Counts changes of what the formulas give; part of the scene's hash."""

HARD_FRAMES = 10

CAMERA = (0.5, 0.5, 1.0)
LAMP_CENTRE, LAMP_RADIUS, LAMP_RADIANCE = (0.15, 0.85), 0.08, 3.0
AMBIENT, SPOT = 0.2, 3.0


class AnalyticRenderer(ClosedFormRenderer):
    """The `ngi.render.Renderer` of a plane lit by a soft spot, in pure PyTorch.

    The plane is the unit square z = 0. Spot centre, spot size, albedo and roughness are smooth
    functions of v, each of which depends on every component. With an emission buffer there is
    also a small lamp that does not move.

        radiance(p) = albedo(v) * (AMBIENT + SPOT * exp(-|p - c(v)|^2 / (2 r(v)^2))) + lamp(p)

    sampling: samples_per_pixel, halves, noise; they and the other arguments are those of
    `ClosedFormRenderer`. By default there are all buffers.
    """

    def __init__(
        self,
        *,
        dimensions: int,
        patch_size: int,
        layout: BufferLayout | None = None,
        **sampling: Unpack[Sampling],
    ) -> None:
        super().__init__(
            dimensions=dimensions,
            patch_size=patch_size,
            **sampling,
            layout=layout or BufferLayout(),
            formula=("analytic", FORMULA_VERSION),
        )
        # Every quantity depends on every variable, each differently.
        self._weights = spread_weights(7, dimensions)

    def hard_frames(self) -> Tensor:
        """[10, D]: fixed points spread over the unit hypercube."""
        return spread_points(HARD_FRAMES, self.dimensions)

    def shade(self, scene_vectors: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        # In [-1, 1]; the root keeps the frequency in v the same whatever D.
        phase = (scene_vectors[:, None] * self._weights).sum(-1) / sqrt(self.dimensions)
        wave = torch.sin(2 * pi * phase)[:, None, None]
        centre, size = 0.5 + 0.3 * wave[..., :2], 0.2 + 0.1 * wave[..., 2:3]
        albedo, roughness = 0.5 + 0.4 * wave[..., 3:6], 0.5 + 0.4 * wave[..., 6:]
        point = torch.nn.functional.pad(points, (0, 1))
        distance = (points - centre).square().sum(-1, keepdim=True)
        spot = SPOT * torch.exp(-distance / (2 * size**2))
        radiance = albedo * (AMBIENT + spot)
        to_lamp = (points - torch.tensor(LAMP_CENTRE)).norm(dim=-1, keepdim=True)
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
            "direct": torch.log1p(albedo * spot),
            "emission": torch.log1p(lamp),
        }
        return torch.cat([buffers[name] for name in self.layout.names], -1), radiance
