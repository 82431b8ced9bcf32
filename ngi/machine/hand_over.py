"""Dr.Jit's arrays read and written by PyTorch, in the order of the GPU's streams.

On CUDA the host waits for neither library. Dr.Jit has one stream per device, made with
`CU_STREAM_DEFAULT` in the device's primary context, which PyTorch uses as well; PyTorch's default
stream is CUDA's legacy default stream. What is queued in the legacy stream begins once all that was
queued in such a stream has ended, and what is queued there afterwards begins once it has ended
(CUDA Runtime API, "Stream synchronization behavior"). So what PyTorch does in its default stream

- waits for the kernels that Dr.Jit has queued, and sees what they have computed,
- and whatever Dr.Jit queues later waits for it. That may use the memory of arrays again that Python
  has let go of meanwhile, since Dr.Jit gives out memory in the order of its stream.

Sources, of Dr.Jit 1.5.0: `drjit-core/src/cuda_core.cpp` (context and streams), `malloc.cpp`
(memory), `drjit-core/jit.h` at `jit_cuda_sync_stream` ("no need to ever synchronize with the global
NULL stream"), `src/python/dlpack.cpp` (what it does for which stream; elsewhere than on CUDA it
waits until the array is there), and its author in pull request 377 of mitsuba-renderer/drjit.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.dlpack import DLDeviceType, from_dlpack

LEGACY = 0
"""PyTorch's handle of CUDA's legacy default stream."""


def tensor_of(array: Any) -> Tensor:
    """The memory of an evaluated array of Dr.Jit's, as PyTorch sees it.

    Asked for it by PyTorch, Dr.Jit 1.5 raises an exception first, for it knows no versions.
    """
    tensor: Tensor = from_dlpack(array.__dlpack__())
    return tensor


def stacked(arrays: Sequence[Any]) -> Tensor:
    """C arrays of n numbers, being computed or not any more, to a copy [n, C] where they are.

    arrays: evaluated, and at least one; anything with DLPack's methods
    Raises RuntimeError, as `overwrite` does, where PyTorch is in another stream.
    """
    _check_stream(arrays[0])
    return torch.stack([tensor_of(array) for array in arrays], dim=-1)


def overwrite(array: Any, numbers: NDArray[np.float64]) -> None:
    """Writes n numbers into an evaluated array of n, which stays where it is.

    Kernels that Dr.Jit has queued read what was there before, later ones what is there then.
    """
    _check_stream(array)
    memory = tensor_of(array)
    source = torch.from_numpy(numbers).to(memory.dtype)
    if memory.is_cuda:  # else the host would wait until it is copied
        source = source.pin_memory()
    memory.copy_(source, non_blocking=True)


def _check_stream(array: Any) -> None:
    """RuntimeError where what PyTorch does now would not be in order with Dr.Jit."""
    kind, index = array.__dlpack_device__()
    if kind == DLDeviceType.kDLCUDA and torch.cuda.current_stream(index).cuda_stream != LEGACY:
        raise RuntimeError(
            "Dr.Jit hands over arrays in CUDA's legacy default stream, but PyTorch uses another: "
            "render outside of torch.cuda.stream()"
        )
