"""What the viewer's picture shows of a configuration, as pixels, and through which curve."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor

from ngi.evaluate import tone_map
from ngi.evaluate.pictures import eight_bit, error_picture
from ngi.view.contact_sheet import buffer_picture
from ngi.view.scene_view import SceneView

CURVES = ("sRGB", "filmic", "linear")


def shown(radiance: Tensor, *, curve: str, exposure: float) -> Tensor:
    """[H, W, 3] linear RGB to values in [0, 1] for a screen; NaN where a pixel is not finite.

    curve: 'sRGB', as the metrics see pictures; 'filmic', Narkowicz's fit of the ACES curve before
    the sRGB one, which keeps highlights; 'linear', clipped and without any.
    exposure: stops
    """
    if curve == "sRGB":
        return tone_map(radiance, exposure)
    visible = torch.where(radiance.isfinite(), radiance * 2.0**exposure, torch.nan)
    if curve == "linear":
        return visible.clamp(0, 1)
    if curve == "filmic":
        x = visible.clamp(min=0)
        return tone_map((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14))
    raise ValueError(f"curve '{curve}': choose one of {', '.join(CURVES)}")


Pixels = NDArray[np.uint8]

PARTS: dict[str, tuple[str, ...]] = {
    "network": ("network",),
    "path tracer": ("path tracer",),
    "error": ("error",),
    "network | path tracer": ("network", "path tracer"),
    "network | path tracer | error": ("network", "path tracer", "error"),
}
"""What can be shown beside the buffers, and the pictures side by side that it consists of."""

NEEDS = {"network": {"network"}, "path tracer": {"paths"}, "error": {"network", "paths"}}
"""Parts of a view, as `SceneView.has` names them, that each of these pictures is made from."""


@dataclass(frozen=True)
class Screen:
    """What to show, and how.

    show: a key of `PARTS`, or a buffer's name
    curve, exposure: of light, see `ngi.view.screen.shown`; other buffers and errors have none
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
    def needs(self) -> set[str]:
        """What of a view it is made from, as `SceneView.has` names it."""
        return set().union(*(NEEDS.get(part, {"buffers"}) for part in self.parts))

    @property
    def traces_paths(self) -> bool:
        """Whether more samples per pixel would show."""
        return "paths" in self.needs

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
        picture = buffer_picture(part, buffer, lambda light: Image.fromarray(self._toned(light)))
        return np.asarray(picture)

    def _toned(self, radiance: Tensor) -> Pixels:
        return eight_bit(shown(radiance, curve=self.curve, exposure=self.exposure))
