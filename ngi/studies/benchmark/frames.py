"""Frames of our method by their parts, beside those of path tracing with a denoiser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Self

import torch
from torch import Tensor, nn

from ngi.config.build import build_network, build_samples, training_device
from ngi.config.configuration import composed
from ngi.denoise import OpenImageDenoise
from ngi.learn import Samples
from ngi.machine.precision import dtype_of, fast_precision
from ngi.machine.timing import in_turn
from ngi.methods.path_tracing.frame_time import show
from ngi.methods.path_tracing.tracing import PathTracing
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.scenes import Scene

RESOLUTIONS = (96, 256, 900)
"""That of the test frames of `budget=small`, of the viewer, and of the paper's pictures."""
SAMPLES_PER_PIXEL = 8
"""Of the paths that are denoised."""
FEWER_RAYS = 8
"""Per pixel, of buffers that take half the rays (`+renderer.buffer_samples=8`)."""


def frames(scene: Scene, *, repeats: int, seconds: float) -> list[Figure]:
    """Milliseconds by part, of frames whose v is a new one every time.

    The denoiser is given buffers for nothing: it needs those of the first hit without direct light,
    which take less than ours. It is timed at its best, and at its fastest.
    """
    made = Ours.of(scene)
    figures = [
        _frames(made, resolution, repeats=repeats, seconds=seconds / len(RESOLUTIONS))
        for resolution in RESOLUTIONS
    ]
    return [figure for of_one in figures for figure in of_one]


@dataclass(frozen=True)
class Ours:
    """Renderer, samples and untrained network of `method=ours` and `budget=small`.

    size: of the network, as '6x128'. precision: of its products on this machine
    """

    renderer: MitsubaRenderer
    samples: Samples
    network: nn.Module
    size: str
    precision: torch.dtype

    @classmethod
    def of(cls, scene: Scene) -> Self:
        # without the denoiser of its training patches, which is not on every machine
        config = composed("method=ours", "budget=small", "data=patches_without_camera")
        renderer = MitsubaRenderer(
            scene=scene.read(), direct=config.renderer.direct, specular=config.renderer.specular
        )
        samples = build_samples(config, renderer=renderer)
        network = build_network(config, samples=samples).to(training_device(config))
        size = f"{config.model.hidden_layers}x{config.model.hidden_features}"
        precision = dtype_of(fast_precision())
        return cls(renderer, samples, network, size, precision)

    def predict(self, buffers: Tensor, v: Tensor, *, preview: bool = False) -> Tensor:
        """[H, W, 3] radiance, of buffers [H, W, C] and v [D]; preview: without finer edges."""
        inputs = self.samples.test_inputs(v, buffers, preview=preview)
        render, precision = self.samples.render, self.precision
        return show(self.network, buffers, *inputs, precision=precision, render=render)


@dataclass(frozen=True)
class _Times:
    """Seconds of each part of the frames, in the order of the rounds."""

    buffers: list[float]
    fewer_rays: list[float]
    network: list[float]
    paths: list[float]
    denoiser: list[float]
    fast_denoiser: list[float]


def _frames(made: Ours, resolution: int, *, repeats: int, seconds: float) -> list[Figure]:
    renderer = made.renderer
    tracing, fast = (
        PathTracing(
            renderer=renderer, denoiser=denoiser, samples_per_pixel=SAMPLES_PER_PIXEL, seed=0
        )
        for denoiser in (OpenImageDenoise(), OpenImageDenoise(quality="fast"))
    )
    hard = renderer.hard_frames()
    buffers = renderer.image_buffers(hard[0], resolution=resolution).cpu()
    noisy = tracing.trace(hard[0], resolution=resolution)

    def every_v(start: float) -> Iterator[Tensor]:
        """All of them in turn, for one function; others start elsewhere, so that v changes."""
        return cycle(hard.roll(-int(start * len(hard)), dims=0))

    for_buffers, for_fewer_rays, for_network, for_paths = map(every_v, (0, 0.5, 0.25, 0.75))
    times = in_turn(
        repeats,
        f"frames, {resolution} pixels",
        lambda: renderer.image_buffers(next(for_buffers), resolution=resolution),
        lambda: renderer.image_buffers(
            next(for_fewer_rays), resolution=resolution, samples=FEWER_RAYS
        ),
        lambda: made.predict(buffers, next(for_network)),
        lambda: tracing.trace(next(for_paths), resolution=resolution),
        partial(tracing.denoise, noisy, buffers),
        partial(fast.denoise, noisy, buffers),
        seconds=seconds,
    )
    return _figures(_Times(*times), f"{resolution} × {resolution}", network=made.size)


def _figures(times: _Times, size: str, *, network: str) -> list[Figure]:
    """Of the parts in milliseconds, and the shares of the denoiser's time.

    size, network: in their names
    """
    ours = _sums(times.buffers, times.network)
    denoised = _sums(times.paths, times.denoiser)
    fast_denoised = _sums(times.paths, times.fast_denoiser)
    parts = {
        "buffers with direct light": times.buffers,
        f"the same, {FEWER_RAYS} rays per pixel": times.fewer_rays,
        f"network {network}": times.network,
        "ours": ours,
        f"paths, {SAMPLES_PER_PIXEL} samples per pixel": times.paths,
        "denoiser": times.denoiser,
        "paths and denoiser": denoised,
        "fast denoiser": times.fast_denoiser,
    }
    with_fewer = _sums(times.fewer_rays, times.network)
    shares = {
        "ours / paths and denoiser": ratio(ours, denoised),
        f"ours with {FEWER_RAYS} rays / paths and denoiser": ratio(with_fewer, denoised),
        "ours / paths and fast denoiser": ratio(ours, fast_denoised),
    }
    return [
        *(
            figure(f"{part}, {size}", [1e3 * second for second in seconds], "ms")
            for part, seconds in parts.items()
        ),
        *(figure(f"{name}, {size}", share, "×", "≤ 0.5") for name, share in shares.items()),
    ]


def _sums(of_one: list[float], of_another: list[float]) -> list[float]:
    return [a + b for a, b in zip(of_one, of_another, strict=True)]
