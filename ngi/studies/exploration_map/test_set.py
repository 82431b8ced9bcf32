"""What the runs of a setting are tested on."""

from __future__ import annotations

import math
from collections.abc import Callable

import torch
from torch import Tensor
from torch.quasirandom import SobolEngine

from ngi.render import PocketRenderer

IN_POCKETS = 0.1
"""Part of the frames whose v is taken into a pocket, so that the rarest are tested too."""

TAIL = 0.05
"""Part of the frames, those of the largest error, that make the tail."""

RESOLUTION = 8
"""Pixels along a frame's side: points of the image that the error is a mean over."""


class TestSet:
    """Noise-free frames of a scene: 90 % spread evenly over [0, 1]^D, 10 % over the pockets.

    Both are points of one scrambled Sobol sequence. The error of a frame is the mean absolute
    difference of log1p radiance, over pixels and colours.
    """

    __test__ = False  # of no interest to pytest

    def __init__(self, renderer: PocketRenderer, *, frames: int) -> None:
        self._everywhere = frames - math.ceil(IN_POCKETS * frames)
        points = SobolEngine(renderer.dimensions, scramble=True, seed=0).draw(frames)
        inside = renderer.into_pockets(points[self._everywhere :])
        self._scene_vectors = torch.cat([points[: self._everywhere], inside])
        images = [renderer.whole_image(v, RESOLUTION) for v in self._scene_vectors]
        self._buffers = torch.stack([buffers for buffers, _ in images])
        self._log_radiance = torch.stack([radiance for _, radiance in images]).log1p()
        self._dark = renderer.weights(points[: self._everywhere]).sum(dim=1) == 0

    @torch.no_grad()
    def errors(self, network: Callable[[Tensor, Tensor], Tensor]) -> dict[str, float]:
        """Mean error over the frames everywhere, in the pockets, and over the tail of them all.

        And of the first what is due to frames without any effect (error_dark), and the mean by
        which these are too bright (false_light).

        network: buffers [n, H, W, C] and v [n, D] to log1p radiance [n, H, W, 3], all on the CPU
        """
        prediction = network(self._buffers, self._scene_vectors)
        difference = prediction - self._log_radiance
        errors = difference.abs().mean(dim=(1, 2, 3))
        everywhere, brighter = errors[: self._everywhere], difference.mean(dim=(1, 2, 3))
        tail = errors.topk(math.ceil(TAIL * len(errors))).values
        return {
            "error_uniform": everywhere.mean().item(),
            "error_dark": (everywhere * self._dark).mean().item(),
            "false_light": (brighter[: self._everywhere] * self._dark).mean().item(),
            "error_pocket": errors[self._everywhere :].mean().item(),
            "error_tail": tail.mean().item(),
        }
