"""A network that knows the closed formulas: what it loses is noise, and nothing else."""

import torch
from torch import Tensor

from ngi.models import PixelGenerator
from ngi.render import AnalyticRenderer


class KnownRadiance(PixelGenerator):
    """Answers with the radiance of `ngi.render.AnalyticRenderer`, whatever its weights."""

    def forward(self, buffers: Tensor, scene_vector: Tensor) -> Tensor:
        renderer = AnalyticRenderer(dimensions=self.scene_dimensions, patch_size=1)
        points = buffers[..., self.layout.slice("position")][..., :2]
        _, radiance = renderer.shade(scene_vector, points)
        return torch.log1p(radiance) + 0 * super().forward(buffers, scene_vector)
