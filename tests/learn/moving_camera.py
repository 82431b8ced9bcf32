"""Closed formulas with a camera that v moves, over a shadow that no buffer tells."""

from typing import Any

import torch
from torch import Tensor

from ngi.render import AnalyticRenderer

SCENE_VARIABLES = 2
STRIPES = 3


class MovingCamera(AnalyticRenderer):
    """The analytic scene, half of which the camera sees; the last two of four variables move it.

    Radiance is half as large on the dark ones of `STRIPES` hard-edged pairs of vertical stripes.
    """

    camera_part = slice(SCENE_VARIABLES, SCENE_VARIABLES + 2)

    def __init__(self, *, patch_size: int, noise: float = 0.0, halves: bool = False) -> None:
        super().__init__(
            dimensions=SCENE_VARIABLES + 2,
            patch_size=patch_size,
            noise=noise,
            halves=halves,
            samples_per_pixel=1 + halves,
        )
        self._weights[:, self.camera_part] = 0

    def shade(self, scene_vectors: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        corner = scene_vectors[:, None, None, self.camera_part] / 2
        seen = corner + points / 2
        buffers, radiance = super().shade(scene_vectors, seen)
        lit = (seen[..., :1] * STRIPES % 1 < 0.5).float()
        return buffers, radiance * (1 + lit) / 2

    def cameras(self, scene_vectors: Tensor) -> Tensor:
        corner = scene_vectors[:, self.camera_part] / 2
        ahead = torch.tensor([1.0, 0.0, 0.0, -1.0]).expand(len(corner), -1)
        return torch.cat([corner + 0.25, ahead], dim=1)


def moving_camera(**options: Any) -> MovingCamera:
    """For `renderer._target_`, whatever else the configuration of a renderer says."""
    return MovingCamera(patch_size=options["patch_size"], halves=options.get("halves", False))
