"""What the renderer needs of a backend: a window of pixels in, averaged samples out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import blake2b
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

Pending = Callable[[], Tensor]
"""Waits for a computation that may still be running and returns its [height, width, channels],
float32, on the device that computed it."""


@dataclass(frozen=True)
class Window:
    """width x height pixels whose first is (x, y), of a square image of `resolution` pixels."""

    x: int
    y: int
    width: int
    height: int
    resolution: int


class Tracer(Protocol):
    """Traces camera rays through the pixels of a window of the scene as it stands."""

    def radiance(self, window: Window, *, samples: int, seed: int) -> Pending:
        """Mean linear RGB radiance over `samples` paths per pixel, box-filtered. seed: 32 bits."""
        ...

    def buffers(self, window: Window, *, samples: int) -> Pending:
        """Mean first-hit channels (radiance linear) over the same sub-pixel points everywhere.

        samples: how many there are in each pixel
        """
        ...


def subpixel_points(count: int) -> NDArray[np.float64]:
    """[count, 2] points of a Hammersley set in the unit square, shifted to the cells' middle.

    The buffers use the same points in every pixel: no noise, and no dependence on a seed. One
    point is the pixel's centre.
    """
    indices = np.arange(count)
    bits = max(1, int(count - 1).bit_length())
    reversed_bits = sum(((indices >> bit) & 1) << (bits - 1 - bit) for bit in range(bits))
    second = (reversed_bits + 0.5) / 2**bits if count > 1 else np.array([0.5])
    return np.stack([(indices + 0.5) / count, second], axis=1)


def derive_seed(*parts: int | bytes) -> int:
    """A 32-bit seed that depends on every part and on nothing else, such as a batch's order."""
    digest = blake2b(digest_size=4)
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        digest.update(len(data).to_bytes(4, "little") + data)
    return int.from_bytes(digest.digest(), "little")
