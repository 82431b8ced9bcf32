"""A whole image by a network, as a viewer asks for it."""

from __future__ import annotations

import torch
from torch import Tensor, nn


def show(network: nn.Module, buffers: Tensor, v: Tensor, precision: torch.dtype) -> Tensor:
    """The network's image, [H, W, 3] on the CPU."""
    device = next(network.parameters()).device
    with torch.autocast(device.type, torch.bfloat16, enabled=precision == torch.bfloat16):
        image: Tensor = network.render(buffers.to(device), v.to(device))  # type: ignore[operator]
    return image.cpu()
