"""Streams, events and graphs of the pretended GPU.

A graph keeps what is launched while it is captured, with the memory of the operands, and launches
just that when it is replayed. What the host does between two launches is not in it, and what would
have the host wait can not be captured, as on a real GPU.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import torch
from torch import Tensor
from torch.utils._python_dispatch import _disable_current_modes
from torch.utils._pytree import tree_leaves

from tests.gpu.pretended import LEDGER, TAPE, waited


class Stream:
    """All work is done in order here, whatever the stream."""

    cuda_stream = 0

    def wait_stream(self, _: Stream) -> None:
        """Nothing to wait for."""


class Event:
    """Is passed once the host has waited for it, or for the device, after it was recorded."""

    def __init__(self, *, enable_timing: bool = False) -> None:
        self._timed = enable_timing

    def record(self) -> None:
        self._seconds, self._number = time.perf_counter(), LEDGER.record()

    def query(self) -> bool:
        return LEDGER.passed >= self._number

    def synchronize(self) -> None:
        """Where no event comes after it, the device has nothing to do until the host goes on."""
        since = LEDGER.recorded - self._number
        if self.query():
            return
        if since == 0:
            waited()
        else:
            LEDGER.looks.append(since)
            LEDGER.pass_by(self._number)

    def elapsed_time(self, end_event: Event) -> float:
        assert self._timed
        if not (self.query() and end_event.query()):
            raise RuntimeError("CUDA error: device not ready")
        return 1e3 * (end_event._seconds - self._seconds)


class Graph:
    def __init__(self) -> None:
        self.tape: list[Any] = []

    def replay(self) -> None:
        LEDGER.launches["graph"] += 1
        with _disable_current_modes(), torch.no_grad(), torch._C._DisableAutocast():
            for operator, args, kwargs, results in self.tape:
                again = operator(*args, **kwargs)
                for kept, new in zip(tree_leaves(results), tree_leaves(again), strict=True):
                    if isinstance(kept, Tensor) and kept.data_ptr() != new.data_ptr():
                        kept.copy_(new)


@contextmanager
def capture(graph: Graph, *, stream: Stream, capture_error_mode: str) -> Iterator[None]:
    """What is launched is written down. Here it is computed too; a real GPU computes nothing."""
    assert isinstance(stream, Stream)
    assert capture_error_mode == "thread_local"
    TAPE.append(graph.tape)
    try:
        yield
    finally:
        TAPE.clear()


GRAPHS: dict[str, Callable[..., Any]] = {
    "Stream": Stream,
    "Event": Event,
    "CUDAGraph": Graph,
    "graph": capture,
    "stream": lambda _: nullcontext(),
    "current_stream": lambda *_: Stream(),
}
"""By their names in `torch.cuda`."""
