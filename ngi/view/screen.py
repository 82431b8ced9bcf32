"""What the viewer's picture shows of a configuration, as pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from ngi.evaluate.pictures import eight_bit, error_picture
from ngi.view.gallery import buffer_picture
from ngi.view.scene_view import SceneView
from ngi.view.tone import shown

Pixels = NDArray[np.uint8]

PARTS: dict[str, tuple[str, ...]] = {
    "network": ("network",),
    "path tracer": ("path tracer",),
    "error": ("error",),
    "network | path tracer": ("network", "path tracer"),
    "network | path tracer | error": ("network", "path tracer", "error"),
}
"""What can be shown beside the buffers, and the pictures side by side that it consists of."""


@dataclass(frozen=True)
class Screen:
    """What to show, and how.

    show: a key of `PARTS`, or a buffer's name
    curve, exposure: see `ngi.view.tone.shown`
    epsilon: of the relative error, as in the evaluation protocol
    """

    show: str = "network"
    curve: str = "sRGB"
    exposure: float = 0.0
    epsilon: float = 0.01

    @property
    def parts(self) -> tuple[str, ...]:
        return PARTS.get(self.show, (self.show,))

    @property
    def traces_paths(self) -> bool:
        """Whether more samples per pixel would show."""
        return bool({"path tracer", "error"} & set(self.parts))

    def pixels(self, view: SceneView) -> Pixels:
        """[H, W * number of parts, 3]; pixels that are NaN or Inf in cyan."""
        return np.concatenate([self._part(part, view) for part in self.parts], axis=1)

    def _part(self, part: str, view: SceneView) -> Pixels:
        pictures: dict[str, Callable[[], Pixels]] = {
            "network": lambda: self._toned(view.prediction),
            "path tracer": lambda: self._toned(view.reference),
            "error": lambda: error_picture(view.prediction, view.reference, self.epsilon),
        }
        if part in pictures:
            return pictures[part]()
        buffer = view.buffers[..., view.renderer.layout.slice(part)]
        return np.asarray(buffer_picture(part, buffer))

    def _toned(self, radiance: Tensor) -> Pixels:
        return eight_bit(shown(radiance, curve=self.curve, exposure=self.exposure))
