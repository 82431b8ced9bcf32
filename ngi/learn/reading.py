"""What the host has to know of a step, asked of the device once."""

from __future__ import annotations

import torch
from torch import Tensor


def read(*tensors: Tensor) -> list[Tensor]:
    """Each of them on the CPU, without its graph, in one copy: a GPU is waited for once.

    tensors: of floating point; those that are not on the CPU yet are on one device
    """
    known = [tensor.detach() for tensor in tensors]
    away = [tensor for tensor in known if tensor.device.type != "cpu"]
    if not away:
        return known
    # float64 holds every number of the others.
    together = torch.cat([tensor.double().flatten() for tensor in away]).cpu()
    parts = iter(together.split([tensor.numel() for tensor in away]))
    return [t if t.device.type == "cpu" else next(parts).to(t.dtype).view(t.shape) for t in known]
