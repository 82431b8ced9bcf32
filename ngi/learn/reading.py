"""What the host has to know of a step, asked of the device once."""

from __future__ import annotations

import torch
from torch import Tensor


class Reading:
    """Tensors on their way to the CPU, in one copy; called, it gives them.

    The copy is queued where it is made, and what is queued after it does not hold it up.

    tensors: of floating point; those that are not on the CPU yet are on one device
    """

    def __init__(self, *tensors: Tensor) -> None:
        self._known = [tensor.detach() for tensor in tensors]
        away = [tensor for tensor in self._known if tensor.device.type != "cpu"]
        self._copied: torch.cuda.Event | None = None
        if not away:
            return
        # float64 holds every number of the others.
        together = torch.cat([tensor.double().flatten() for tensor in away])
        self._together = together.to("cpu", non_blocking=together.is_cuda)  # to pinned memory
        if together.is_cuda:
            self._copied = torch.cuda.Event()
            self._copied.record()

    def __call__(self) -> list[Tensor]:
        """Each of them on the CPU, without its graph. The host waits until it is there."""
        away = [tensor.numel() for tensor in self._known if tensor.device.type != "cpu"]
        if not away:
            return self._known
        if self._copied is not None:
            self._copied.synchronize()
        parts = iter(self._together.split(away))
        return [
            t if t.device.type == "cpu" else next(parts).to(t.dtype).view(t.shape)
            for t in self._known
        ]


def read(*tensors: Tensor) -> list[Tensor]:
    """Each of them on the CPU: see `Reading`. A GPU is waited for once."""
    return Reading(*tensors)()
