"""A network that sees an image at several resolutions (Ronneberger et al. 2015)."""

from collections.abc import Sequence
from itertools import pairwise

import torch
import torch.nn.functional as F
from torch import Tensor, nn


class UNet(nn.Module):
    """Convolutions at ever coarser resolutions and back, with skip connections.

    The last layer sees the input too: what it says of a pixel can be of this pixel alone, which
    convolutions have to learn. At edges of the scene that is decisive in short trainings.

    widths: features at full resolution and at each coarser one, which has half of the pixels a side
    """

    def __init__(self, *, inputs: int, outputs: int, widths: Sequence[int]) -> None:
        super().__init__()
        self.down = nn.ModuleList(
            nn.Conv2d(a, b, 3, padding=1) for a, b in pairwise([inputs, *widths])
        )
        self.up = nn.ModuleList(
            nn.Conv2d(a + b, a, 3, padding=1) for a, b in reversed(list(pairwise(widths)))
        )
        self.last = nn.Conv2d(widths[0] + inputs, outputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """[n, inputs, H, W] to [n, outputs, H, W]; the image is extended where halves are odd."""
        height, width = x.shape[2:]
        step = 2 ** (len(self.down) - 1)
        pixels = x
        x = F.pad(x, (0, -width % step, 0, -height % step), mode="replicate")
        skipped: list[Tensor] = []
        for level, convolution in enumerate(self.down):
            x = F.leaky_relu(convolution(x if level == 0 else halved(x)))
            skipped.append(x)
        skipped.pop()
        for convolution in self.up:
            x = F.interpolate(x, scale_factor=2.0)
            x = F.leaky_relu(convolution(torch.cat([skipped.pop(), x], dim=1)))
        output: Tensor = self.last(torch.cat([x[..., :height, :width], pixels], dim=1))
        return output


def halved(x: Tensor) -> Tensor:
    """[n, c, H, W] to half the size, the maximum of every 2 x 2 pixels; H and W are even.

    `F.max_pool2d`, bit for bit and in the same order in memory, which decides how convolutions
    round, with a gradient that repeats on CUDA, where that one's does not.
    """
    corners = [x[..., row::2, column::2] for row in (0, 1) for column in (0, 1)]
    largest = torch.stack(corners).max(dim=0).values
    if x.is_contiguous(memory_format=torch.channels_last):
        return largest.contiguous(memory_format=torch.channels_last)
    return largest
