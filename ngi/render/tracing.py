"""What the renderer needs of a backend: a window of pixels in, averaged samples out.

And how many paths it asks for at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Pending = Callable[[], Tensor]
"""Waits for a computation that may still be running and returns its [height, width, channels], of a
list of pixels [n, channels], float32, on the device that computed it."""


@dataclass(frozen=True)
class Window:
    """width x height pixels whose first is (x, y), of a square image of `resolution` pixels."""

    x: int
    y: int
    width: int
    height: int
    resolution: int

    @property
    def shape(self) -> tuple[int, ...]:
        return self.height, self.width

    def halves(self) -> tuple[Window, Window] | None:
        """The upper rows and the lower ones; None of a single row."""
        if self.height == 1:
            return None
        rows = self.height - self.height // 2
        lower = replace(self, y=self.y + rows, height=self.height - rows)
        return replace(self, height=rows), lower


@dataclass(frozen=True)
class PixelList:
    """Any pixels of a square image of `resolution` pixels a side.

    numbers: [n] int64 on the CPU, counted from 0 row by row
    caustics: False leaves their light out of the buffers
    """

    numbers: Tensor
    resolution: int
    caustics: bool = True

    @property
    def shape(self) -> tuple[int, ...]:
        return (len(self.numbers),)

    def halves(self) -> tuple[PixelList, PixelList] | None:
        """None of a single pixel."""
        if len(self.numbers) == 1:
            return None
        first, *rest = self.numbers.split(-(-len(self.numbers) // 2))
        return replace(self, numbers=first), replace(self, numbers=torch.cat(rest))


Pixels = Window | PixelList


class Tracer(Protocol):
    """Traces camera rays through pixels of the scene as it stands."""

    def radiance(self, window: Window, *, samples: int, seed: int) -> Pending:
        """Mean linear RGB radiance over `samples` paths per pixel, box-filtered. seed: 32 bits."""
        ...

    def buffers(self, pixels: Pixels, *, samples: int) -> Pending:
        """Mean first-hit channels (radiance linear) over the same sub-pixel points everywhere.

        samples: how many there are in each pixel
        """
        ...


def subpixel_points(count: int) -> NDArray[np.float64]:
    """[count, 2] points of a Hammersley set in the unit square, see `stratified`.

    The buffers use the same points in every pixel: no noise, and no dependence on a seed. One
    point is the pixel's centre.
    """
    indices = np.arange(count)
    bits = max(1, int(count - 1).bit_length())
    reversed_bits = sum(((indices >> bit) & 1) << (bits - 1 - bit) for bit in range(bits))
    return stratified(np.stack([indices, reversed_bits], axis=1))


def stratified(points: NDArray[Any]) -> NDArray[np.float64]:
    """Points [n, k], in every dimension moved to the middle of one of n equal cells, in their
    order: the mean is 0.5 however many there are.
    """
    return (points.argsort(axis=0).argsort(axis=0) + 0.5) / len(points)


def derive_seed(*parts: int | bytes) -> int:
    """A 32-bit seed that depends on every part and on nothing else, such as a batch's order."""
    digest = blake2b(digest_size=4)
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        digest.update(len(data).to_bytes(4, "little") + data)
    return int.from_bytes(digest.digest(), "little")


PATHS_PER_LAUNCH = 2**22
"""Images and patches are traced in launches of about this many paths at most: about 200 MB."""

SAMPLES_PER_PASS = 256
"""Samples of an image's pixel that are summed in single precision before double takes over."""


def bands(resolution: int, samples: int) -> list[Window]:
    """The rows of a square image, as many at a time as `PATHS_PER_LAUNCH` allows."""
    rows = min(resolution, max(1, PATHS_PER_LAUNCH // (resolution * samples)))
    return [
        Window(0, y, resolution, min(rows, resolution - y), resolution)
        for y in range(0, resolution, rows)
    ]


def passes(samples: int, pixels: int) -> list[int]:
    """Samples per pixel of each launch: as few launches as `PATHS_PER_LAUNCH` allows, alike."""
    count = min(samples, -(-samples * pixels // PATHS_PER_LAUNCH))
    return [samples // count + (i < samples % count) for i in range(count)]


def require_positive(**numbers: int) -> None:
    """ValueError, naming it, for a number below 1."""
    for name, number in numbers.items():
        if number < 1:
            raise ValueError(f"renderer: {name} is {number}; expected a positive integer")


def halved(samples: int) -> int:
    """Samples per pixel of each half; ValueError for an odd number of them."""
    if samples % 2:
        raise ValueError(
            f"renderer.samples_per_pixel is {samples}; renderer.halves=true needs an even number"
        )
    return samples // 2


def choose(name: str, choice: str, *, among: tuple[str, ...]) -> None:
    """ValueError, naming it, for a choice that there is not."""
    if choice not in among:
        raise ValueError(f"renderer.{name} '{choice}': choose one of {', '.join(among)}")


def check_states(states: Tensor, dimensions: int) -> None:
    """ValueError for states that are not [n, D + 2] numbers in [0, 1]."""
    if states.ndim != 2 or states.shape[1] != dimensions + 2:
        raise ValueError(
            f"states of shape {list(states.shape)}: expected [n, {dimensions + 2}], "
            f"{dimensions} scene variables and the patch position"
        )
    inside = (states >= 0) & (states <= 1)  # NaN is outside too
    if not bool(inside.all()):
        row, column = (~inside).nonzero()[0].tolist()
        raise ValueError(
            f"states[{row}, {column}] is {float(states[row, column])}; expected 0 to 1"
        )


def patch_window(position: Tensor, *, patch_size: int, resolution: int) -> Window:
    """The patch of P x P pixels at a position (x, y) in [0, 1]^2 of a square virtual image.

    Its first column is floor(x * (resolution - P + 1)), clamped to the last one; rows alike.
    Raises ValueError for a patch larger than the image.
    """
    if patch_size > resolution:
        raise ValueError(
            f"a patch of {patch_size} pixels is larger than the image of {resolution}; choose a "
            "resolution of at least patch_size"
        )
    last = resolution - patch_size
    x, y = (min(int(p * (last + 1)), last) for p in position.tolist())
    return Window(x, y, patch_size, patch_size, resolution)


def of_centres(states: Tensor, *, patch_size: int, resolution: int) -> Tensor:
    """States [n, D + 2] whose patches have their centres where the given ones' positions are.

    Of positions drawn uniformly, `patch_window` alone has few patches reach the image's border: of
    patches of 32 pixels in an image of 96, a pixel in a corner is in 1/469 as many as the mean
    pixel. Here a position (x, y) in [0, 1]^2 is the centre of a patch anywhere in the image,
    which is moved into it: no pixel is in less than a quarter as many as the mean one. Raises
    ValueError for states that are not in [0, 1].
    """
    check_states(states, states.shape[1] - 2)
    last = resolution - patch_size
    centres = (states[:, -2:].double() * (resolution + 1)).floor()
    corners = (centres - patch_size // 2).clamp(0, last)
    return torch.cat([states[:, :-2], ((corners + 0.5) / (last + 1)).to(states)], dim=1)
