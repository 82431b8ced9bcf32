"""Pixels that show several surfaces: the network is asked for each quarter of them."""

import torch
from torch import Tensor
from torch.nn.functional import max_pool2d, pad

from ngi.patches import BufferLayout
from ngi.render.protocol import Renderer

LEAST = {"position": 0.05, "normal": 0.3, "albedo": 0.5, "direct": 0.5, "emission": 0.3}
"""The difference of a component of a buffer, as `BufferLayout` says it is stored, that is an edge.

docs/learner/README.md: what they are worth.
"""

QUARTERS = ((0, 0), (0, 1), (1, 0), (1, 1))
"""Of a pixel: row and column in the image of twice as many pixels a side."""

SIZES = 16
"""Numbers of pixels, evenly up to all of them, that renderers are asked for: of each Dr.Jit makes
a recording."""


def edges(buffers: Tensor, layout: BufferLayout) -> Tensor:
    """[H, W] bool of buffers [H, W, C]: where what is seen changes within 3 x 3 pixels."""
    found = torch.zeros(buffers.shape[:2], dtype=torch.bool, device=buffers.device)
    for name, least in LEAST.items():
        if name in layout.names:
            found |= _differences(buffers[..., layout.slice(name)]) > least
    return found


def quarters(
    scene_vector: Tensor, buffers: Tensor, renderer: Renderer
) -> tuple[Tensor, Tensor] | tuple[()]:
    """Which pixels of an image of v [D] show several surfaces, and the buffers of their quarters.

    buffers: [H, W, C] of the image, a square one
    Gives [n], counted row by row, and [4, n, C]; nothing where there is no edge. Each quarter has
    as many rays as a pixel. Some pixels may come twice, see `SIZES`.
    """
    side = len(buffers)
    pixels = edges(buffers, renderer.layout).flatten().cpu().nonzero().flatten()
    if len(pixels) == 0:
        return ()
    unit = max(1, side**2 // SIZES)
    pixels = pad(pixels, (0, -len(pixels) % unit), value=int(pixels[-1]))
    rows, columns = 2 * (pixels // side), 2 * (pixels % side)
    numbers = torch.cat([(rows + y) * 2 * side + columns + x for y, x in QUARTERS])
    found = renderer.pixel_buffers(scene_vector, numbers, resolution=2 * side)
    return pixels, found.unflatten(0, (len(QUARTERS), len(pixels)))


def with_quarters(image: Tensor, pixels: Tensor, answers: Tensor) -> Tensor:
    """An image [H, W, 3] of log1p radiance whose pixels [n] are means of these [4, n, 3]."""
    means = answers.expm1().mean(dim=0).log1p()
    return image.flatten(0, 1).index_copy(0, pixels, means.to(image)).view(image.shape)


def _differences(values: Tensor) -> Tensor:
    """[H, W] of [H, W, k]: the largest difference of a component within 3 x 3 pixels."""
    planes = pad(values.float().movedim(-1, 0)[None], (1, 1, 1, 1), mode="replicate")
    spread = max_pool2d(planes, 3, stride=1) + max_pool2d(-planes, 3, stride=1)
    return spread[0].amax(dim=0)
