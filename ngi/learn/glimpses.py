"""Few pixels of a patch, which tell what it shows without its paths being traced."""

import torch
from torch import Tensor

from ngi.render.protocol import Renderer
from ngi.render.tracing import patch_window

PIXELS_APART = 4
"""Rows and columns from one pixel of a glimpse to the next: one in 16 of a patch is in it."""

RAYS = 4
"""Per pixel of a patch that is looked at: a mean over its pixels wants no more."""


def sparse(images: Tensor) -> Tensor:
    """Images [n, H, W, k] to [n, h, w, k], the pixels of a glimpse."""
    return images[:, ::PIXELS_APART, ::PIXELS_APART]


def glimpsed_buffers(states: Tensor, renderer: Renderer, *, resolution: int) -> Tensor:
    """[n, h, w, C]: `sparse` of the buffers of patches at states [n, D + 2], without caustics.

    With `RAYS` per pixel, or fewer where patches have fewer. The scene is set up once for states of
    the same v that follow each other.
    """
    vectors, counts = torch.unique_consecutive(states[:, :-2], dim=0, return_counts=True)
    pixels = torch.stack([_pixels(p, renderer.patch_size, resolution) for p in states[:, -2:]])
    rays = min(RAYS, renderer.buffer_samples)
    groups = pixels.split(counts.tolist())
    found = [
        renderer.pixel_buffers(
            vector, group.flatten(), resolution=resolution, samples=rays, caustics=False
        )
        for vector, group in zip(vectors, groups, strict=True)
    ]
    return torch.cat(found).view(*pixels.shape, -1)


def _pixels(position: Tensor, patch_size: int, resolution: int) -> Tensor:
    """[h, w] int64, counted in the image row by row."""
    window = patch_window(position, patch_size=patch_size, resolution=resolution)
    steps = torch.arange(0, patch_size, PIXELS_APART)
    first = window.y * resolution + window.x
    return first + steps[:, None] * resolution + steps
