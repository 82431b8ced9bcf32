"""Frames of our method by their parts, beside those of path tracing with a denoiser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import cycle

import torch
from torch import Tensor, nn

from ngi.denoise import OpenImageDenoise
from ngi.machine.precision import fast_precision
from ngi.machine.timing import in_turn
from ngi.methods.path_tracing.frame_time import show
from ngi.methods.path_tracing.tracing import PathTracing
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.scenes import Scene
from ngi.studies.benchmark.training import OURS

RESOLUTIONS = (96, 256, 900)
"""That of the test frames of `budget=small`, of the viewer, and of the paper's pictures."""
FEATURES, LAYERS = 128, 6
"""Of the network of `budget=small`."""
SAMPLES_PER_PIXEL = 8
"""Of the paths that are denoised."""
FEWER_RAYS = 8
"""Per pixel, of buffers that take half the rays (`+renderer.buffer_samples=8`)."""


def frames(scene: Scene, *, repeats: int, seconds: float) -> list[Figure]:
    """Milliseconds by part, of frames whose v is a new one every time.

    The denoiser is given buffers for nothing: it needs those of the first hit without direct light,
    which take less than ours.
    """
    renderer, network = ours(scene)
    made = [
        _frames(renderer, network, resolution, repeats=repeats, seconds=seconds / len(RESOLUTIONS))
        for resolution in RESOLUTIONS
    ]
    return [figure for figures in made for figure in figures]


def ours(scene: Scene) -> tuple[MitsubaRenderer, nn.Module]:
    """Renderer and untrained network of `method=ours` and `budget=small`."""
    renderer = MitsubaRenderer(scene=scene.read(), direct="with_caustics", specular="traced")
    network = OURS.network(
        layout=renderer.layout,
        scene_dimensions=renderer.dimensions,
        hidden_features=FEATURES,
        hidden_layers=LAYERS,
        relative=True,
        moving=renderer.moving_points,
    )
    return renderer, network.to("cuda" if torch.cuda.is_available() else "cpu")


def precision() -> torch.dtype:
    """Of the network's products on this machine."""
    return torch.bfloat16 if fast_precision() == "bf16-mixed" else torch.float32


@dataclass(frozen=True)
class _Times:
    """Seconds of each part of the frames, in the order of the rounds."""

    buffers: list[float]
    fewer_rays: list[float]
    network: list[float]
    paths: list[float]
    denoiser: list[float]


def _frames(
    renderer: MitsubaRenderer,
    network: nn.Module,
    resolution: int,
    *,
    repeats: int,
    seconds: float,
) -> list[Figure]:
    tracing = PathTracing(
        renderer=renderer,
        denoiser=OpenImageDenoise(),
        samples_per_pixel=SAMPLES_PER_PIXEL,
        seed=0,
    )
    hard = renderer.hard_frames()
    buffers = renderer.image_buffers(hard[0], resolution=resolution).cpu()
    noisy = tracing.trace(hard[0], resolution=resolution)
    bits = precision()

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
        lambda: show(network, buffers, next(for_network), bits),
        lambda: tracing.trace(next(for_paths), resolution=resolution),
        partial(tracing.denoise, noisy, buffers),
        seconds=seconds,
    )
    return _figures(_Times(*times), f"{resolution} × {resolution}")


def _figures(times: _Times, size: str) -> list[Figure]:
    """Of the parts in milliseconds, and the shares of the denoiser's time. size: in their names."""
    ours = _sums(times.buffers, times.network)
    denoised = _sums(times.paths, times.denoiser)
    parts = {
        "buffers with direct light": times.buffers,
        f"the same, {FEWER_RAYS} rays per pixel": times.fewer_rays,
        f"network {LAYERS}x{FEATURES}": times.network,
        "ours": ours,
        f"paths, {SAMPLES_PER_PIXEL} samples per pixel": times.paths,
        "denoiser": times.denoiser,
        "paths and denoiser": denoised,
    }
    shares = {
        "ours": ours,
        f"ours with {FEWER_RAYS} rays": _sums(times.fewer_rays, times.network),
    }
    return [
        *(
            figure(f"{part}, {size}", [1e3 * second for second in seconds], "ms")
            for part, seconds in parts.items()
        ),
        *(
            figure(f"{name} / paths and denoiser, {size}", ratio(seconds, denoised), "×", "≤ 0.5")
            for name, seconds in shares.items()
        ),
    ]


def _sums(of_one: list[float], of_another: list[float]) -> list[float]:
    return [a + b for a, b in zip(of_one, of_another, strict=True)]
