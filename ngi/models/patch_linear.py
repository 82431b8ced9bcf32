"""A linear layer in which what is constant over a patch costs as much as a bias."""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor, nn


class PatchLinear(nn.Linear):
    """`nn.Linear` on the concatenation [pixel features..., v] of every pixel of n patches.

    Its parameters and their initialisation are those of `nn.Linear` on the concatenation, and so
    is its result. The concatenation is never formed: each part meets its own columns of the
    weight, and the part of the scene vector v, which is constant over a patch, is one bias per
    patch. (The release repeats v at every pixel.)

    weight: [out_features, sum(pixel_features) + scene_dimensions]; bias: [out_features]
    """

    def __init__(
        self, *, pixel_features: Sequence[int], scene_dimensions: int, out_features: int
    ) -> None:
        super().__init__(sum(pixel_features) + scene_dimensions, out_features)
        self.widths = (*pixel_features, scene_dimensions)

    def forward(self, pixels: Sequence[Tensor], scene_vector: Tensor) -> Tensor:  # type: ignore[override]
        """Tensors [n, p, features] for p pixels per patch and v [n, D] to [n, p, out_features].

        Under autocast the products run in the lower precision, but inputs that come in full
        precision are not rounded to it: bfloat16 would move positions by up to 1/512 of the
        scene's box, and would take two scenes for one.
        """
        *weights, scene_weight = self.weight.split(self.widths, dim=1)
        output = _linear(pixels[0], weights[0])
        for part, weight in zip(pixels[1:], weights[1:], strict=True):
            output += _linear(part, weight)
        with torch.autocast(scene_vector.device.type, enabled=False):
            patch_bias = F.linear(scene_vector, scene_weight, self.bias)
        output += patch_bias[:, None].to(output.dtype)
        return output


def _linear(x: Tensor, weight: Tensor) -> Tensor:
    """Product x · weightᵀ; under autocast, float32 x enters as the sum of two numbers."""
    device = x.device.type
    if torch.is_autocast_enabled(device) and x.dtype == torch.float32:
        high = x.to(torch.get_autocast_dtype(device))
        low = (x - high).to(high.dtype)
        return F.linear(torch.cat([high, low], dim=-1), torch.cat([weight, weight], dim=1))
    return F.linear(x, weight)
