"""What passes between a pool and its workers, and what a worker does wherever it runs."""

import pickle
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import torch
from torch import Tensor

from ngi.render.protocol import RenderedPatches, Renderer


@dataclass(frozen=True)
class Request:
    """What `Renderer.render_patches` is to be called with; states: [n, D + 2]."""

    states: Tensor
    resolution: int
    seed: int


Reply = RenderedPatches | Exception | None
"""The patches, or what was raised instead; None says that a worker is ready."""


class WorkerDiedError(Exception):
    """A worker is gone; says what ended it."""


class Worker(Protocol):
    """The pool's end of a renderer elsewhere, which is starting and warming up.

    Its first reply says that it is ready, or why it cannot render at all; then every request gets
    one, in order.
    """

    name: str
    """For the log: which worker, and where it runs."""

    def send(self, request: Request) -> None:
        """Does not wait; whether the worker is there shows in `receive`."""
        ...

    def receive(self) -> Reply:
        """Waits for the next reply; raises WorkerDiedError, also after `kill` in another thread."""
        ...

    def kill(self) -> None:
        """Ends it at once; nothing in it has to be saved. Can be repeated."""
        ...

    def release(self) -> None:
        """Waits until it is gone, after `kill`, and gives back what this end holds, if anything."""
        return


class RenderServer:
    """The worker's end: makes a renderer and answers requests with it.

    make: pickled function without arguments that makes the renderer.
    threads: of Dr.Jit, where the renderer uses it.
    """

    def __init__(self, make: bytes, *, threads: int) -> None:
        self._make = make
        self._threads = threads
        self._renderer: Renderer

    def start(self) -> Reply:
        """Makes the renderer and warms it up."""
        return _attempt(self._start)

    def render(self, request: Request) -> Reply:
        """The patches that are asked for, in this machine's memory."""
        return _attempt(lambda: self._render(request))

    def _render(self, request: Request) -> RenderedPatches:
        patches = self._renderer.render_patches(
            request.states, resolution=request.resolution, seed=request.seed
        )
        half = patches.first_half
        return replace(
            patches,
            buffers=patches.buffers.cpu(),
            log_radiance=patches.log_radiance.cpu(),
            first_half=None if half is None else half.cpu(),
        )

    def _start(self) -> None:
        torch.set_num_threads(1)  # of a patch's few operations
        self._renderer = pickle.loads(self._make)()
        if "ngi.machine.backend" in sys.modules:
            from ngi.machine.backend import dr

            dr.set_thread_count(self._threads)
        self._renderer.warm_up()


def _attempt(action: Callable[[], RenderedPatches | None]) -> Reply:
    """What `action` gives, or what it raises, as it can be pickled; the traceback is a note."""
    try:
        return action()
    except Exception as error:
        note = f"In a renderer's worker:\n{traceback.format_exc()}"
        try:
            travelled: Exception = pickle.loads(pickle.dumps(error))
        except Exception:  # of the error's own, or of its arguments
            travelled = RuntimeError(f"{type(error).__name__}: {error}")
        travelled.add_note(note)
        return travelled
