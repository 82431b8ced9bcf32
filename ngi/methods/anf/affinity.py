"""Filters whose weights are affinities of features (Işık et al. 2021, Sec. 3.3 and 3.4)."""

import torch
import torch.nn.functional as F
from torch import Tensor

EPSILON = 1e-10
"""Of their Eq. 6 and 8: keeps a sum of weights above 0."""


def neighbourhood(image: Tensor, *, size: int, dilation: int) -> Tensor:
    """[n, c, size², H, W]: of every pixel those around it, row by row; 0 outside of the image.

    image: [n, c, H, W]. size: pixels of the neighbourhood's side, odd; they are `dilation` apart.
    """
    n, c, height, width = image.shape
    columns = F.unfold(image, size, dilation=dilation, padding=dilation * (size // 2))
    return columns.view(n, c, size**2, height, width)


def spatial_weights(
    features: Tensor, bandwidth: Tensor, centre: Tensor, *, size: int, dilation: int
) -> Tensor:
    """[n, size², H, W], Eq. 4: exp(−a |f_p − f_q|²) for q around p, and c for p itself.

    They are not normalised, and are 0 for q outside of the image.
    features: f, [n, c, H, W]; bandwidth: a ≥ 0, [n, 1, H, W]; centre: c, [n, 1, H, W] in [0, 1]
    """
    around = temporal_weights(features, features, bandwidth, size=size, dilation=dilation)
    middle = size**2 // 2
    return torch.cat([around[:, :middle], centre, around[:, middle + 1 :]], dim=1)


def temporal_weights(
    features: Tensor,
    earlier: Tensor,
    bandwidth: Tensor,
    known: Tensor | None = None,
    *,
    size: int,
    dilation: int = 1,
) -> Tensor:
    """[n, size², H, W], Eq. 7: exp(−b |f_p − g_q|²) for q around p and at p.

    They are not normalised, and are 0 for q outside of the image and where q is not known.
    features: f, [n, c, H, W]; earlier: g, [n, c, H, W]; bandwidth: b ≥ 0, [n, 1, H, W]
    known: [n, 1, H, W], 1 or 0; everywhere where None
    """
    around = neighbourhood(earlier, size=size, dilation=dilation)
    distance = (features[:, :, None] - around).square().sum(dim=1)
    inside = torch.ones_like(bandwidth) if known is None else known
    inside = neighbourhood(inside, size=size, dilation=dilation)[:, 0]
    return torch.exp(-bandwidth * distance) * inside


def weighted_mean(*parts: tuple[Tensor, Tensor], size: int, dilations: tuple[int, ...]) -> Tensor:
    """[n, c, H, W], Eq. 6 and 8: the mean over the neighbourhoods in all parts.

    parts: image [n, c, H, W] and weights [n, size², H, W] of each; dilations: of each
    """
    total: Tensor | float = 0.0
    weight: Tensor | float = EPSILON
    for (image, weights), dilation in zip(parts, dilations, strict=True):
        around = neighbourhood(image, size=size, dilation=dilation)
        total = total + (around * weights[:, None]).sum(dim=2)
        weight = weight + weights.sum(dim=1, keepdim=True)
    assert isinstance(total, Tensor)
    return total / weight


def warped(image: Tensor, source: Tensor) -> tuple[Tensor, Tensor]:
    """The earlier frame where it is now: their W, nearest pixel. And where it is known, 1 or 0.

    image: [n, c, H, W]. source: [n, H, W] int64, the pixel that each one was, counted row by row;
    negative for none, which becomes 0.
    """
    known = (source >= 0)[:, None].to(image.dtype)
    index = source.clamp(min=0).flatten(1)[:, None].expand(-1, image.shape[1], -1)
    return image.flatten(2).gather(2, index).view_as(image) * known, known
