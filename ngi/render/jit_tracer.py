"""Tracing with Dr.Jit (LLVM or CUDA): one kernel for radiance, one for buffers, never compiled
again after the first patch.

The film's crop window is not used, since it would be compiled into the kernel; the rays of a
window are asked of the sensor directly. Everything that differs from window to window is opaque.
"""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import prod
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ngi.machine.backend import dr, mi
from ngi.machine.hand_over import stacked
from ngi.render.caustics import Caustics, photon_points
from ngi.render.direct_light import emitter_probabilities, light_points
from ngi.render.first_hit import FirstHit
from ngi.render.fitting import does_not_fit
from ngi.render.recorded_scene import RecordedScene
from ngi.render.tracing import Pending, Pixels, Tracer, Window, subpixel_points
from ngi.scene.variable_scene import VariableScene

Trace = Callable[..., "list[mi.Float]"]

RECORDINGS = 100
"""From how many recordings of one function on Dr.Jit warns that something is wrong."""

_logger = logging.getLogger(__name__)


class JitTracer(Tracer):
    """The `ngi.render.tracing.Tracer` of the JIT variants; results are computed asynchronously.

    Of each size of window and number of samples the kernel launches are recorded once and then
    replayed: tracing the Python code takes up to a fifth of a second in a scene of many materials,
    whatever the size.

    recorded: False where Dr.Jit must not record anything of this scene
    """

    def __init__(
        self,
        *,
        scene: VariableScene,
        first_hit: FirstHit,
        recorded: bool = True,
    ) -> None:
        loaded = self._scene = scene.scene
        replayed = partial(_replayed, scene=RecordedScene(scene), recorded=recorded)
        caustics = first_hit.caustics
        self._light = None if caustics is None else _PhotonLight(scene, caustics, replayed)
        self._points: dict[int, tuple[mi.Point2f, list[mi.Float]]] = {}
        # Plain functions, not methods: a frozen function follows the arrays of its arguments only,
        # and holds what is constant for this tracer in its closure.
        integrator = loaded.integrator()
        sampler = mi.load_dict({"type": "independent"})

        def trace_radiance(
            view: _View, seed: mi.UInt32, samples: int, paths: int
        ) -> list[mi.Float]:
            rng = sampler.fork()
            rng.seed(seed, paths)
            ray = view.rays(loaded, dr.arange(mi.UInt32, paths) // view.samples, rng.next_2d())
            radiance, _, _ = integrator.sample(loaded, rng, mi.RayDifferential3f(ray))
            return _block_sums(list(mi.Color3f(radiance)), samples)

        def trace_buffers(
            view: _View,
            numbers: list[mi.UInt32],
            points: mi.Point2f,
            light_points: list[mi.Float],
            light: list[mi.Float],
            samples: int,
            rays: int,
        ) -> list[mi.Float]:
            index = dr.arange(mi.UInt32, rays)
            pixel = index // view.samples
            sample = index - pixel * view.samples
            for listed in numbers:  # one list, or none where the window's pixels are asked for
                pixel = dr.gather(mi.UInt32, listed, pixel)
            jitter = dr.gather(mi.Point2f, points, sample)
            light_point = [dr.gather(mi.Float, each, sample) for each in light_points]
            ray = view.rays(loaded, pixel, jitter)
            return _block_sums(first_hit.channels(loaded, ray, light_point, *light), samples)

        self._radiance = replayed(trace_radiance)
        self._buffers = replayed(trace_buffers)
        self._trace_radiance = trace_radiance
        self._ready = False

    def radiance(self, window: Window, *, samples: int, seed: int) -> Pending:
        self._prepare(window)
        view = _View.of(window, samples)
        paths = window.width * window.height * samples
        sums = self._radiance(view, dr.opaque(mi.UInt32, seed), samples, paths)
        return _pending(sums, window.shape, samples)

    def buffers(self, pixels: Pixels, *, samples: int) -> Pending:
        if isinstance(pixels, Window):
            window, numbers = pixels, []
        else:
            side = pixels.resolution
            window, numbers = Window(0, 0, side, side, side), [mi.UInt32(pixels.numbers.numpy())]
        self._prepare(window)
        if samples not in self._points:
            self._points[samples] = _points(samples, emitter_probabilities(self._scene))
        view, rays = _View.of(window, samples), prod(pixels.shape) * samples
        points = self._points[samples]
        photons = isinstance(pixels, Window) or pixels.caustics
        light = [] if self._light is None else self._light.now(photons=photons)
        sums = self._buffers(view, numbers, *points, light, samples, rays)
        return _pending(sums, pixels.shape, samples)

    def _prepare(self, window: Window) -> None:
        """Before the first recording.

        What is left of an earlier scene in reference cycles is still in Dr.Jit's registry, and
        recording a frozen function trips over it. It also trips over what is made at the first
        use only, such as the tables that textured emitters are sampled by; so radiance is traced
        once, with one sample per pixel, the result of which is thrown away.
        """
        if self._ready:
            return
        gc.collect()
        pixels = window.width * window.height
        view, seed = _View.of(window, 1), dr.opaque(mi.UInt32, 0)
        dr.eval(self._trace_radiance(view, seed, 1, pixels))
        self._ready = True


class _PhotonLight:
    """What photons leave in the scene, traced once while nothing but the camera moves.

    replayed: makes a function that is recorded, `_replayed` of the scene
    """

    def __init__(
        self, scene: VariableScene, caustics: Caustics, replayed: Callable[[Trace], Trace]
    ) -> None:
        def trace_photons(photons: list[mi.Float]) -> list[mi.Float]:
            light = caustics.trace(scene.scene, photons)
            dr.eval(light)
            return [light]

        self._scene, self._photons = scene, photon_points()
        self._trace = replayed(trace_photons)
        self._light: list[mi.Float] = []
        self._light_of = -1
        self._dark = [caustics.pictures.dark()]

    def now(self, *, photons: bool) -> list[mi.Float]:
        """As `FirstHit.channels` takes it; dark without photons."""
        if not photons:
            return self._dark
        if self._light_of != self._scene.changes:
            self._light = self._trace(self._photons)
            self._light_of = self._scene.changes
        return self._light


def _points(samples: int, emitters: NDArray[np.float64]) -> tuple[mi.Point2f, list[mi.Float]]:
    """Where in each pixel its rays go through, and the numbers that go with each for the light."""
    points = subpixel_points(samples)
    on_device = (
        mi.Point2f(points[:, 0], points[:, 1]),
        [mi.Float(numbers) for numbers in light_points(samples, emitters).T],
    )
    dr.eval(on_device)
    return on_device


def _replayed(function: Trace, *, scene: RecordedScene, recorded: bool) -> Trace:
    """The function with its kernel launches recorded and replayed, where Dr.Jit can do that.

    Dr.Jit 1.5 cannot always, for example where another scene was loaded meanwhile: then Python
    traces the function again every time, which costs time but compiles nothing either.
    """
    if not recorded:
        return function
    # At every call Dr.Jit walks through what a frozen function's closure holds, dataclasses in
    # Python: the materials of living-room were half of it. What `function` holds it does not see.
    # A variable material makes a recording for every combination of the choices.
    replayed = dr.freeze(lambda _, *arguments: function(*arguments), warn_after=RECORDINGS)
    given = [scene.parts, scene.whole]  # what is missing in the first is in the second

    def trace(*arguments: Any) -> list[mi.Float]:
        while given:
            try:
                return list(replayed(given[0](), *arguments))
            except RuntimeError as error:
                if does_not_fit(error):
                    raise
                _go_on_with_signals(error)
                del given[0]
                level = logging.DEBUG if given else logging.WARNING
                _logger.log(level, "pictures of this scene take longer: %s", error)
        return function(*arguments)

    return trace


def _go_on_with_signals(error: BaseException) -> None:
    """Raises what a signal's handler has raised: Dr.Jit makes an error of whatever is raised while
    it records.
    """
    cause = error.__cause__
    while cause is not None:
        if not isinstance(cause, Exception):  # KeyboardInterrupt, SystemExit
            raise cause
        cause = cause.__cause__


def free_memory() -> None:
    """Gives back what Dr.Jit and PyTorch keep for later, once launches under way have ended."""
    dr.sync_thread()
    dr.flush_malloc_cache()
    if torch.cuda.is_initialized():
        torch.cuda.empty_cache()


@dataclass(frozen=True)
class _View:
    """A window and its number of samples as opaque arrays of size 1, a PyTree for Dr.Jit."""

    x: mi.UInt32
    y: mi.UInt32
    width: mi.UInt32
    samples: mi.UInt32
    resolution: mi.Float

    @classmethod
    def of(cls, window: Window, samples: int) -> _View:
        return cls(
            x=dr.opaque(mi.UInt32, window.x),
            y=dr.opaque(mi.UInt32, window.y),
            width=dr.opaque(mi.UInt32, window.width),
            samples=dr.opaque(mi.UInt32, samples),
            resolution=dr.opaque(mi.Float, window.resolution),
        )

    def rays(self, scene: mi.Scene, pixel: mi.UInt32, jitter: mi.Point2f) -> mi.Ray3f:
        """Rays through the pixels of the window, numbered row by row, at a point in [0, 1]^2."""
        row = pixel // self.width
        column = pixel - row * self.width
        film_position = mi.Point2f(
            (mi.Float(self.x + column) + jitter.x) / self.resolution,
            (mi.Float(self.y + row) + jitter.y) / self.resolution,
        )
        ray, _ = scene.sensors()[0].sample_ray(0, 0, film_position, mi.Point2f(0.5))
        return ray


def _block_sums(values: list[mi.Float], samples: int) -> list[mi.Float]:
    """Sums over the samples of each pixel, which lie side by side: no atomics, always the same."""
    dr.eval(values)  # together: block_sum evaluates its input, each channel with its own kernel
    sums = [dr.block_sum(value, samples) for value in values]
    dr.eval(sums)
    return sums


def _pending(sums: list[mi.Float], shape: tuple[int, ...], samples: int) -> Pending:
    def read() -> Tensor:
        mean = stacked(sums).div_(samples)
        return mean.view(*shape, len(sums))

    return read
