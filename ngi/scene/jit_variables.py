"""The Dr.Jit variables behind the objects of a loaded scene."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ngi.machine.backend import dr, mi
from ngi.machine.hand_over import tensor_of


def variables_of(node: mi.Object) -> list[mi.UInt64]:
    """Every variable that an object and its children hold, in the order of their declaration.

    They pretend to be integers: to be evaluated, or asked for their address, but not to be read.
    """
    indices: list[int] = []
    with dr.scoped_set_flag(dr.JitFlag.EnableObjectTraversal, True):
        node._traverse_1_cb_ro(lambda index, *_: indices.append(index))
    return [dr.detail.update_indices(mi.UInt64(0), [index]) for index in indices if index]


def evaluate(nodes: Iterable[mi.Object]) -> None:
    """Evaluates what objects have left unevaluated, each by itself.

    A bitmap leaves the mean of its new texels. The next kernel would evaluate those of several
    bitmaps together, and another one would be compiled for every set of bitmaps that changed.
    """
    for node in nodes:
        dr.eval([v for v in variables_of(node) if v.state == dr.VarState.Unevaluated])


def address(variable: dr.ArrayBase) -> int:
    """Where an evaluated variable lies in memory."""
    return tensor_of(variable).data_ptr()


_ALIGNMENT = 64
"""Bytes, of Dr.Jit's own memory."""


def aligned(numbers: NDArray[np.float64], kind: DTypeLike) -> NDArray[np.generic]:
    """A copy of another type, in memory that begins where Dr.Jit's own would.

    Dr.Jit takes NumPy's memory as it is. Its kernels are others for memory that begins elsewhere: a
    frozen function would be recorded again by chance, once for every combination of its inputs.
    """
    dtype = np.dtype(kind)
    memory = np.empty(numbers.size * dtype.itemsize + _ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    array = memory[start : start + numbers.size * dtype.itemsize].view(dtype)
    array[:] = numbers.ravel()
    return array.reshape(numbers.shape)
