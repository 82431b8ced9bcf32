"""Buffers that are made without random numbers of the run."""

import torch
from torch import Tensor

from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark.measure import counted_kernels


def assert_seedless(renderer: MitsubaRenderer) -> Tensor:
    """Asserts that buffers depend on no seed and no order, and that patches show the image.

    Nor is a kernel compiled once the renderer is warm. Gives the buffers of four patches of 8 × 8,
    [4, 8, 8, C].
    """
    renderer.warm_up()
    states = torch.rand(4, renderer.dimensions + 2, generator=torch.Generator().manual_seed(0))
    with counted_kernels() as kernels:
        first = renderer.render_patches(states, resolution=24, seed=1).buffers
        second = renderer.render_patches(states.flip(0), resolution=24, seed=2).buffers.flip(0)
    assert kernels.compiled == 0
    assert torch.equal(first, second)
    for state, patch in zip(states, first, strict=True):
        column, row = (min(int(p * 17), 16) for p in state[-2:].tolist())
        image = renderer.image_buffers(state[:-2], resolution=24)
        torch.testing.assert_close(
            patch, image[row : row + 8, column : column + 8], atol=1e-5, rtol=0
        )
    return first
