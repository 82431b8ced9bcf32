"""The same pixels by two backends: LLVM on the processor, CUDA on the GPU."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from ngi.machine.backend import cuda_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.scenes import Scene
from ngi.studies.gpu_check.item import Outcome

BACKENDS = ("llvm", "cuda")
BUFFER_TOLERANCE = 1e-3
"""Buffers are in [-1, 1] or logarithms; further apart than that a pixel is another surface's, or a
magnified bitmap's, which a GPU's texture units blend with 8 bits of fraction."""
RADIANCE_TOLERANCE = 1e-2
"""Relative to 1 + radiance. Both backends take the same random numbers."""


def pixels(scene: Scene, *, resolution: int, samples: int) -> Outcome:
    """How many pixels of the first hard frame differ between the backends, in buffers of ours:
    chains of mirrors and glass, direct light and photons.

    Where CUDA does not work, LLVM takes its place.
    """
    problem = cuda_problem()
    first, second = BACKENDS if problem is None else (BACKENDS[0],) * 2
    frames = [_frame(scene, backend, resolution, samples) for backend in (first, second)]
    figures = [replace(found, scene=scene.name) for found in differences(frames[0], frames[1])]
    return Outcome(figures, [] if problem is None else [f"LLVM twice, no CUDA: {problem}"])


def differences(one: tuple[Tensor, Tensor], other: tuple[Tensor, Tensor]) -> list[Figure]:
    """Of buffers [H, W, C] and linear radiance [H, W, 3] of the same frame."""
    of_buffers = (one[0] - other[0]).abs().amax(dim=-1)
    of_radiance = ((one[1] - other[1]).abs() / (1 + one[1].abs())).amax(dim=-1)
    means = [radiance.double().mean() for _, radiance in (one, other)]
    return [
        figure("pixels whose buffers differ", [_share(of_buffers, BUFFER_TOLERANCE)], "%"),
        figure("pixels whose radiance differs", [_share(of_radiance, RADIANCE_TOLERANCE)], "%"),
        figure("difference of mean radiance", [_percent(means[1] / means[0] - 1)], "%", "≤ 0.5"),
    ]


def _frame(scene: Scene, backend: str, resolution: int, samples: int) -> tuple[Tensor, Tensor]:
    renderer = MitsubaRenderer(
        scene=scene.read(), backend=backend, specular="traced", direct="with_caustics"
    )
    v = renderer.hard_frames()[0]
    buffers = renderer.image_buffers(v, resolution=resolution).cpu()
    radiance = renderer.render_image(
        v, resolution=resolution, samples_per_pixel=samples, seed=0
    ).cpu()
    return buffers, radiance


def _share(difference: Tensor, tolerance: float) -> float:
    """Percent of the pixels; NaN differs."""
    return _percent((~(difference <= tolerance)).double().mean())


def _percent(share: Tensor) -> float:
    return 100 * float(torch.as_tensor(share))
