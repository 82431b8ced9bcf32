"""What the benchmark needs of Mitsuba: its own tracing, kernel counts, seconds of our steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import isqrt
from typing import Any

import numpy as np

from ngi.machine.backend import activate, dr, mi
from ngi.render.jit_tracer import JitTracer
from ngi.render.tracing import Pending
from ngi.scene import SceneDescription
from ngi.scene.acceleration import EmbreeScene
from ngi.scene.loading import load
from ngi.scene.variable_scene import VariableScene


class FixedLaunch:
    """Mitsuba's time for `paths` camera paths: one launch, one configuration, nothing around it.

    scene: traced as authored, with the backend that 'auto' chooses.
    paths: number of paths of one launch; paths / samples_per_pixel is a square number. Memory does
        not grow with them (2^25 take as much as 2^18), and below 2^32 Mitsuba makes no two launches
        of them.
    """

    def __init__(self, scene: SceneDescription, *, paths: int, samples_per_pixel: int) -> None:
        activate()
        pixels = isqrt(paths // samples_per_pixel)
        if pixels**2 * samples_per_pixel != paths:
            raise ValueError(f"{paths} paths are no square image at {samples_per_pixel} spp")
        # A scene of its own, which nobody moves.
        self._scene = load(scene.document)
        self._samples = samples_per_pixel
        authored = mi.traverse(self._scene.sensors()[0])
        self._sensor = mi.load_dict(
            {
                "type": "perspective",
                "fov": float(np.ravel(authored["x_fov"])[0]),
                "fov_axis": "x",
                "to_world": mi.ScalarTransform4f(
                    np.array(authored["to_world"].matrix, dtype=float).reshape(4, 4)
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": pixels,
                    "height": pixels,
                    "rfilter": {"type": "box"},
                },
            }
        )

    def warm_up(self) -> None:
        """Compiles what `trace` needs, with few samples.

        Mitsuba's kernel is one for powers of two and one for all other numbers of samples.
        """
        power_of_two = self._samples & (self._samples - 1) == 0
        np.asarray(mi.render(self._scene, sensor=self._sensor, spp=2 if power_of_two else 3))

    def trace(self, seed: int) -> float:
        """Traces and waits; its seconds."""
        start = time.perf_counter()
        image = mi.render(self._scene, sensor=self._sensor, spp=self._samples, seed=seed)
        np.asarray(image)
        return time.perf_counter() - start


@dataclass
class KernelCounts:
    """Kernels that were compiled, and those that a frozen function recorded."""

    compiled: int = 0
    recorded: int = 0


@contextmanager
def counted_kernels() -> Iterator[KernelCounts]:
    """Gives an object that counts, after the block, the kernels launched inside it.

    One that Dr.Jit found on the disk counts as compiled: elsewhere it would not be there. (Dr.Jit
    1.5 calls that a cache hit too.)
    """
    counts = KernelCounts()
    if not mi.variant().startswith(("cuda", "llvm")):
        yield counts  # the scalar variant compiles nothing
        return
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        yield counts
        kernels = dr.kernel_history([dr.KernelType.JIT])
    counts.compiled = sum(not kernel["cache_hit"] or kernel["cache_disk"] for kernel in kernels)
    recorded = dr.KernelRecordingMode.Recorded
    counts.recorded = sum(kernel["recording_mode"] == recorded for kernel in kernels)


STEPS = (
    "parameters",
    "acceleration structure",
    "launching radiance",
    "kernels of radiance",
    "launching buffers",
    "kernels of buffers",
    "copying",
)
"""Steps of rendering a patch: writing the scene's parameters; moving shapes in the acceleration
structure; Python's part of the launches, and the rest of the kernels; results copied."""


@contextmanager
def timed_steps() -> Iterator[dict[str, float]]:
    """Gives the seconds of each of `STEPS` inside the block, of the JIT variants.

    Each step is waited for before the next begins, which otherwise goes on beside it.
    """
    steps = _Steps()
    parameters, structure, *_ = STEPS
    with ExitStack() as stack:
        for owner, name, wrapped in (
            (VariableScene, "apply", steps.waited_for(parameters, VariableScene.apply)),
            (
                mi.Scene,
                "parameters_changed",
                steps.waited_for(structure, mi.Scene.parameters_changed),
            ),
            (EmbreeScene, "move", steps.waited_for(structure, EmbreeScene.move)),
            (JitTracer, "radiance", steps.traced("radiance", JitTracer.radiance)),
            (JitTracer, "buffers", steps.traced("buffers", JitTracer.buffers)),
        ):
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, wrapped)
        yield steps.seconds


class _Steps:
    """Wraps functions so that their seconds are counted."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(STEPS, 0.0)

    def timed(self, step: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Its time counts for the step, less what is counted for steps inside."""

        def call(*arguments: Any, **options: Any) -> Any:
            counted = sum(self.seconds.values())
            start = time.perf_counter()
            result = function(*arguments, **options)
            elapsed = time.perf_counter() - start
            self.seconds[step] += elapsed - (sum(self.seconds.values()) - counted)
            return result

        return call

    def waited_for(self, step: str, function: Callable[..., None]) -> Callable[..., None]:
        """A step that ends when the kernels it launched do."""

        def call(*arguments: Any) -> None:
            function(*arguments)
            dr.sync_thread()

        return self.timed(step, call)

    def traced(self, what: str, launch: Callable[..., Pending]) -> Callable[..., Pending]:
        """A launch, the wait for its kernels, and the reading of what they computed."""

        def call(*arguments: Any, **options: Any) -> Pending:
            pending: Pending = self.timed(f"launching {what}", launch)(*arguments, **options)
            self.timed(f"kernels of {what}", dr.sync_thread)()
            return self.timed("copying", pending)

        return call
