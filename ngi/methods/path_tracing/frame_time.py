"""How long a frame takes, and how many samples per pixel fit into a time."""

import statistics
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle

import torch
from torch import Tensor, nn

from ngi.learn.samples import image_of
from ngi.machine.timing import in_turn


def show(
    network: nn.Module,
    *inputs: Tensor,
    precision: torch.dtype,
    render: Callable[..., Tensor] = image_of,
) -> Tensor:
    """The network's image, [H, W, 3] on the CPU.

    inputs, render: buffers and `Samples.test_inputs`, and `Samples.render`
    """
    device = next(network.parameters()).device
    on_device = (tensor.to(device) for tensor in inputs)
    with torch.autocast(device.type, torch.bfloat16, enabled=precision == torch.bfloat16):
        return render(network, *on_device).cpu()


MOST_SAMPLES = 2**16
"""Per pixel, beyond which nobody asks for more."""

Frame = Callable[[Tensor], object]
"""Makes, or makes a part of, the frame of a v [D]."""


class FrameTimes:
    """Median seconds over configurations. Whatever is compared is timed in turn, v by v."""

    def __init__(self, scene_vectors: Sequence[Tensor]) -> None:
        self._vectors = scene_vectors

    def seconds(self, frames: Mapping[str, Frame], *, what: str) -> dict[str, float]:
        """By name. Each is called once for every configuration, after a warm-up of one.

        what: for the progress bar
        """
        timed = in_turn(len(self._vectors), what, *map(self._over_vectors, frames.values()))
        return dict(zip(frames, map(statistics.median, timed), strict=True))

    def _over_vectors(self, frame: Frame) -> Callable[[], object]:
        vectors = cycle(self._vectors)
        return lambda: frame(next(vectors))


def largest_fitting(fits: Callable[[int], bool]) -> int:
    """The largest number from 1 up that fits, where every smaller one does; 1 where none does.

    At most `MOST_SAMPLES`. It is doubled until it fits no more, then found by bisection.
    """
    low, high = 1, 2
    while high <= MOST_SAMPLES and fits(high):
        low, high = high, 2 * high
    high = min(high, MOST_SAMPLES + 1)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low
