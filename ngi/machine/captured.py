"""Functions of tensors on a GPU whose kernels are recorded once and then launched all at once."""

import logging
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor, nn

WARM_UP = 2
"""Calls before one is recorded, in which libraries allocate what they need."""

MOST = 4
"""Shapes that are recorded; each keeps the memory of all that the function computes."""

log = logging.getLogger(__name__)

Function = Callable[..., tuple[Any, ...]]


class Captured:
    """A function of tensors, launched as one CUDA graph per shape of its arguments.

    A small network's step is hundreds of short kernels, and takes as long as it takes to launch
    them one by one.

    function: of tensors on a GPU to tensors there, or None. It launches the same kernels whatever
        the tensors hold, asks for nothing that it launched, and keeps nothing
    module: whose parameters and buffers it reads besides. Where one has moved, it is recorded anew
    name: of what it does, for the log

    The first call of a shape is launched kernel by kernel, the second is recorded. What a call
    gives holds until the next one. What can not be recorded is launched kernel by kernel from then
    on, and the log says why, once.
    """

    def __init__(self, function: Function, *, module: nn.Module, name: str) -> None:
        self._function = function
        self._module = module
        self._name = name
        self._addresses: list[int] = []
        self._graphs: dict[tuple[Any, ...], _Graph | None] = {}  # None: seen once
        self._gives_up = False

    def __call__(self, *inputs: Tensor) -> tuple[Any, ...]:
        if self._gives_up or not all(tensor.is_cuda for tensor in inputs):
            return self._function(*inputs)
        addresses = [t.data_ptr() for t in (*self._module.parameters(), *self._module.buffers())]
        if addresses != self._addresses:
            self._addresses, self._graphs = addresses, {}
        precision = torch.is_autocast_enabled("cuda") and torch.get_autocast_dtype("cuda")
        key = (torch.is_grad_enabled(), precision, *((t.shape, t.dtype) for t in inputs))
        if key not in self._graphs:
            if len(self._graphs) < MOST:
                self._graphs[key] = None
            return self._function(*inputs)
        graph = self._graphs[key]
        if graph is None:
            try:
                graph = self._graphs[key] = _Graph(self._function, inputs)
            except RuntimeError as error:
                self._give_up(error)
                return self._function(*inputs)
        return graph.replay(inputs)

    def _give_up(self, error: RuntimeError) -> None:
        self._gives_up, self._graphs = True, {}
        why = str(error).strip().splitlines() or [type(error).__name__]
        log.warning(
            "%s: not recorded as a CUDA graph, kernels are launched one by one: %s",
            self._name,
            why[0],
        )


class _Graph:
    """One recorded call. Its arguments are copied to where those of that call are."""

    def __init__(self, function: Function, inputs: Sequence[Tensor]) -> None:
        self._inputs = [tensor.clone() for tensor in inputs]
        stream, current = torch.cuda.Stream(), torch.cuda.current_stream()
        stream.wait_stream(current)
        with torch.cuda.stream(stream):
            for _ in range(WARM_UP):
                function(*self._inputs)
        current.wait_stream(stream)
        # Autocast keeps weights that it has cast; the graph is to cast them at each launch.
        torch.clear_autocast_cache()
        self._graph = torch.cuda.CUDAGraph()
        # Other threads, as the viewer's, may go on using the GPU.
        with torch.cuda.graph(self._graph, stream=stream, capture_error_mode="thread_local"):
            self._outputs = function(*self._inputs)

    def replay(self, inputs: Sequence[Tensor]) -> tuple[Any, ...]:
        for kept, given in zip(self._inputs, inputs, strict=True):
            kept.copy_(given)
        self._graph.replay()
        return self._outputs
