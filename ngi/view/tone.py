"""From linear radiance to what a screen shows."""

from __future__ import annotations

import torch
from torch import Tensor

from ngi.evaluate import tone_map

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
