"""Tensors that say they are on a GPU, hold their numbers on the CPU, and are as strict as CUDA's.

PyTorch's FakeTensorMode knows shapes and devices but no numbers: a run, which accepts, draws and
logs by what its tensors hold, ends at the first `.item()`. These tensors hold numbers, so that
whole runs can be compared with those on the CPU. An operator that is given both kinds raises what
CUDA would raise, and every time that the host waits for the device is written down.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode, return_and_correct_aliasing
from torch.utils._pytree import tree_map_only

import ngi
from tests.gpu.nested import leaves, mapped

DEVICE = torch.device("cuda", 0)
CPU = torch.device("cpu")
BEGINNING = f"{Path(ngi.__file__).parent}{os.sep}"
"""Of the names of the program's files."""
aten = torch.ops.aten

MIXED = {aten.copy_, aten._foreach_copy_}
"""Operators that take tensors of both devices."""
INDEXED = {aten.index, aten.index_put, aten.index_put_, aten._index_put_impl_}
"""Operators whose indices may be on the CPU where what they index is on the GPU."""
WAITING = {aten._local_scalar_dense, aten.nonzero, aten.masked_select, aten.equal, aten._unique2}
"""Operators whose result, or its size, the host has to know: it waits for the device."""


class OnGpu(Tensor):
    """A tensor that says it is on `DEVICE`. `numbers`: what it holds, on the CPU."""

    numbers: Tensor
    device = property(lambda _: DEVICE)  # type: ignore[assignment]
    is_cuda = property(lambda _: True)  # type: ignore[assignment]
    is_cpu = property(lambda _: False)  # type: ignore[assignment]
    __torch_function__ = torch._C._disabled_torch_function_impl  # type: ignore[assignment]

    @staticmethod
    def __new__(cls, numbers: Tensor) -> OnGpu:
        made = Tensor._make_wrapper_subclass(
            cls,
            numbers.size(),
            strides=numbers.stride(),
            storage_offset=numbers.storage_offset(),
            dtype=numbers.dtype,
            device=CPU,  # to autograd, whose CUDA part a build of PyTorch for CPUs lacks
        )
        made.numbers = numbers
        return made

    def __repr__(self, **_: Any) -> str:  # type: ignore[override]
        return f"OnGpu({self.numbers})"

    def __deepcopy__(self, memo: dict[int, Any]) -> Tensor:
        copy = OnGpu(self.numbers.clone()).requires_grad_(self.requires_grad)
        memo[id(self)] = copy = torch.nn.Parameter(copy) if self.is_parameter else copy
        return copy

    @property
    def is_parameter(self) -> bool:
        return isinstance(self, torch.nn.Parameter)

    def __reduce_ex__(self, protocol: Any) -> Any:
        return self.numbers.__reduce_ex__(protocol)  # files are read to the CPU

    def __array__(self, *_: Any) -> Any:
        raise TypeError("can't convert cuda:0 device type tensor to numpy. Use Tensor.cpu()")

    @classmethod
    def __torch_dispatch__(
        cls, operator: Any, types: Any, args: Any = (), kwargs: Any = None
    ) -> Any:
        return computed(operator, args, kwargs or {})


class _Zeros(Tensor):
    """What C++ makes in a backward pass for a gradient that there is none of; of any device."""


@dataclass
class Ledger:
    """What the host asked of the device: by file and line of the program, how often.

    waits: for results; uploads: copies of tensors to the device; launches: operators that compute
    looks: at what was queued earlier, while the device goes on: events recorded after it, each time
    """

    waits: Counter[str] = field(default_factory=Counter)
    uploads: Counter[str] = field(default_factory=Counter)
    launches: Counter[str] = field(default_factory=Counter)
    looks: list[int] = field(default_factory=list)
    recorded: int = 0  # events since the program began, however often it is cleared
    passed: int = 0  # of these, all that the host knows the device to be past
    copies: list[tuple[int, Tensor, Tensor]] = field(default_factory=list)  # under way to the CPU

    def clear(self) -> None:
        for counts in (self.waits, self.uploads, self.launches, self.looks):
            counts.clear()

    def record(self) -> int:
        """The number of the event."""
        self.recorded += 1
        return self.recorded

    def pass_by(self, event: int) -> None:
        """The device is past this event: what was copied before it is there."""
        self.passed = max(self.passed, event)
        for _, into, numbers in (copy for copy in self.copies if copy[0] < self.passed):
            into.copy_(numbers)
        self.copies = [copy for copy in self.copies if copy[0] >= self.passed]


LEDGER = Ledger()

TAPE: list[list[Any]] = []
"""Of the graph that is being captured, if any: what is launched, with its operands."""


def caller() -> str:
    """The innermost line of the program under way, as 'learn/step.py:123'."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        file = frame.f_code.co_filename
        if file.startswith(BEGINNING):
            return f"{file.removeprefix(BEGINNING)}:{frame.f_lineno}"
        frame = frame.f_back
    return "outside"


@cache
def is_view(operator: Any) -> bool:
    return any(
        argument.alias_info is not None and not argument.alias_info.is_write
        for argument in operator._schema.arguments
    )


def check_devices(operator: Any, args: Any, kwargs: Any) -> None:
    """RuntimeError, as of CUDA, where tensors of both devices meet. A number is of any device."""
    packet = operator.overloadpacket
    if packet in MIXED:
        return
    if packet in INDEXED and isinstance(args[0], OnGpu):
        args = (args[0], *args[2:])
    tensors = [t for t in leaves((args, kwargs)) if isinstance(t, Tensor)]
    on_gpu = [t for t in tensors if isinstance(t, OnGpu)]
    on_cpu = [t for t in tensors if not isinstance(t, OnGpu | _Zeros) and t.ndim > 0]
    if on_gpu and on_cpu:
        raise RuntimeError(
            f"Expected all tensors to be on the same device, but {operator} was given tensors of "
            f"shape {list(on_gpu[0].shape)} on cuda:0 and {list(on_cpu[0].shape)} on cpu"
        )
    first = tensors[0] if tensors else None
    if on_gpu and first is not None and not isinstance(first, OnGpu) and _writes(operator):
        raise RuntimeError(f"{operator} was to write what is on cuda:0 into a tensor on cpu")


@cache
def _writes(operator: Any) -> bool:
    arguments = operator._schema.arguments
    return bool(arguments and arguments[0].alias_info and arguments[0].alias_info.is_write)


def computed(operator: Any, args: Any, kwargs: dict[str, Any]) -> Any:
    """What an operator gives, on the device that it would be on."""
    on_gpu = any(isinstance(leaf, OnGpu) for leaf in leaves((args, kwargs)))
    packet = operator.overloadpacket
    if packet in MIXED:
        on_gpu = isinstance(leaves(args)[0], OnGpu)
        _note_copy(args, waits=not ((args[2:] and args[2]) or kwargs.get("non_blocking")))
    check_devices(operator, args, kwargs)
    in_backward = torch._C._current_graph_task_id() != -1  # where C++ asks for its own device
    if (device := kwargs.get("device")) is not None:
        on_gpu = torch.device(device).type == "cuda" or (in_backward and on_gpu)
        kwargs = {**kwargs, "device": CPU}
        if packet is aten._to_copy:
            _note_move(args[0], on_gpu, waits=not kwargs.get("non_blocking"))
    if on_gpu:
        _note(operator, args)
    plain_args, plain_kwargs = mapped(plain, args), mapped(plain, kwargs)
    result = operator(*plain_args, **plain_kwargs)
    if on_gpu and not is_view(operator):
        for tape in TAPE:
            tape.append((operator, plain_args, plain_kwargs, result))
    if not on_gpu:
        return result.as_subclass(_Zeros) if packet is aten.zeros and in_backward else result
    result = OnGpu(result) if type(result) is Tensor else tree_map_only(Tensor, OnGpu, result)
    return return_and_correct_aliasing(operator, args, kwargs, result)


def _note(operator: Any, args: Any) -> None:
    packet = operator.overloadpacket
    if packet in WAITING or (
        packet in INDEXED
        and any(
            index is not None and (index.dtype in (torch.bool, torch.uint8) or not on(index))
            for index in args[1]
        )
    ):
        waited()
    if not is_view(operator):
        LEDGER.launches[str(operator)] += 1


def _note_copy(args: Any, *, waits: bool) -> None:
    for into, source in zip(leaves(args[0]), leaves(args[1]), strict=True):
        if isinstance(source, Tensor):
            _note_move(source, on(into), waits=waits)


def _note_move(source: Tensor, to_gpu: bool, *, waits: bool) -> None:
    """waits: the caller has not said `non_blocking`. From memory that is not pinned that is so."""
    was = on(source)
    if was and not to_gpu:
        if waits:
            waited()
    elif to_gpu and not was:
        LEDGER.uploads[caller()] += 1
        if waits or not is_pinned(source) or TAPE:
            waited()


def pinned(tensor: Tensor) -> Tensor:
    """A copy that a GPU can read while the host goes on."""
    copy = tensor.clone()
    copy.pinned_for_gpu = True  # type: ignore[attr-defined]
    return copy


def is_pinned(tensor: Tensor) -> bool:
    return getattr(tensor, "pinned_for_gpu", False)


def on(tensor: Tensor) -> bool:
    return isinstance(tensor, OnGpu)


def plain(value: Any) -> Any:
    return value.numbers if isinstance(value, OnGpu) else value


class Gpu(TorchDispatchMode):
    """While it lasts, tensors that are made on 'cuda' are `OnGpu`."""

    def __torch_dispatch__(
        self, operator: Any, types: Any, args: Any = (), kwargs: Any = None
    ) -> Any:
        return computed(operator, args, kwargs or {})


class _Moved(torch.autograd.Function):
    """Between the devices, with the gradient going back."""

    @staticmethod
    def forward(ctx: Any, tensor: Tensor, to_gpu: bool, dtype: torch.dtype, waits: bool) -> Tensor:
        ctx.was = on(tensor), tensor.dtype
        _note_move(tensor, to_gpu, waits=waits)
        numbers = plain(tensor.detach()).to(dtype, copy=True)
        if waits or to_gpu:
            return OnGpu(numbers) if to_gpu else numbers
        under_way = torch.full_like(numbers, torch.nan)  # who reads it too early reads nonsense
        LEDGER.copies.append((LEDGER.recorded, under_way, numbers))
        return under_way

    @staticmethod
    def backward(  # type: ignore[override]
        ctx: Any, gradient: Tensor
    ) -> tuple[Tensor, None, None, None]:
        return moved(gradient, *ctx.was), None, None, None


def moved(tensor: Tensor, to_gpu: bool, dtype: torch.dtype, *, waits: bool = True) -> Tensor:
    """`tensor.to` for another device."""
    result: Tensor = _Moved.apply(tensor, to_gpu, dtype, waits)  # type: ignore[no-untyped-call]
    return result if tensor.requires_grad else result.detach()


def waited() -> None:
    """The host waits for the device."""
    if TAPE:
        raise RuntimeError("CUDA error: operation not permitted when stream is capturing")
    LEDGER.waits[caller()] += 1
    LEDGER.pass_by(LEDGER.record())
