"""How steady a sequence of pictures is: temporal error against a reference, and flicker.

With Δx = x[t+1] - x[t] at one pixel and channel, s(x) the tone-mapped sRGB of `tone_map`, x̄ the
mean of x[t] and x[t+1], f the frames, r the reference's, and means over pairs of frames, pixels and
channels:

    temporal error   sRGB       mean |Δs(f) - Δs(r)|
                     relative   mean |Δf - Δr| / (r̄ + ε)
    flicker          sRGB       mean |Δs(f)|
                     relative   mean |Δf| / (max(f̄, 0) + ε)

The first is the temporal term of the loss of Chaitanya et al. 2017 (Interactive Reconstruction of
Monte Carlo Image Sequences using a Recurrent Denoising Autoencoder). An error that stays the same
costs nothing: that of single pictures is for MAPE and DSSIM to see. Flicker is the temporal error
where nothing moves, Δr = 0, and is meant for such sequences. Of independent normal noise of
standard deviation σ it is 2σ/√π = 1.128 σ.

A reference of N samples per pixel is noisy itself, anew in every frame. It comes as two independent
halves a and b, r = (a + b) / 2, whose half difference has the distribution of r's own error: the
temporal error of a is what perfect frames would have, the floor. The temporal error's

    mean square    sRGB       mean (Δs(f) - Δs(a)) (Δs(f) - Δs(b))

has no such floor, since the halves' errors are independent and their product has mean zero; what
is left is how much s, which is not linear, shifts the mean of noisy values, as far as that changes
from frame to frame. Chance can make it negative where the error is too small for the samples.

All of them grow with what changes between two frames: compare only sequences of one path at one
number of frames.
"""

from abc import ABC, abstractmethod

from torch import Tensor

from ngi.evaluate.metrics import tone_map

Pictures = tuple[Tensor, ...]


class _Sequence(ABC):
    """Means over the pairs of consecutive frames; NaN and Inf in a frame make them NaN or Inf.

    epsilon: of the relative errors, in the unit of the radiance. exposure: in stops.
    """

    def __init__(self, *, epsilon: float, exposure: float) -> None:
        self._epsilon = epsilon
        self._exposure = exposure
        self._last: Pictures = ()
        self._measured: list[dict[str, float]] = []

    def result(self) -> dict[str, float]:
        """By name, of two frames at least."""
        names = self._measured[0]
        return {n: sum(pair[n] for pair in self._measured) / len(self._measured) for n in names}

    def _append(self, *pictures: Tensor) -> None:
        now = tuple(picture.double() for picture in pictures)
        if self._last:
            changes = tuple(x - y for x, y in zip(now, self._last, strict=True))
            means = tuple(0.5 * (x + y) for x, y in zip(now, self._last, strict=True))
            values = self._measure(changes, means)
            self._measured.append({name: value.mean().item() for name, value in values.items()})
        self._last = now

    @abstractmethod
    def _measure(self, changes: Pictures, means: Pictures) -> dict[str, Tensor]:
        """Per pixel and channel; of what was appended, its Δ and its mean over two frames."""


class TemporalError(_Sequence):
    """'srgb', 'relative' and 'mean_square' of frames that are added in turn."""

    def add(self, frame: Tensor, half_a: Tensor, half_b: Tensor) -> None:
        """Linear radiance, [H, W, 3] each, of the same v."""
        linear = (frame, 0.5 * (half_a + half_b))
        shown = (tone_map(x, self._exposure) for x in (*linear, half_a, half_b))
        self._append(*linear, *shown)

    def _measure(self, changes: Pictures, means: Pictures) -> dict[str, Tensor]:
        f, r, sf, sr, sa, sb = changes
        return {
            "srgb": (sf - sr).abs(),
            "relative": (f - r).abs() / (means[1] + self._epsilon),
            "mean_square": (sf - sa) * (sf - sb),
        }


class Flicker(_Sequence):
    """'srgb' and 'relative' of frames that are added in turn."""

    def add(self, frame: Tensor) -> None:
        """Linear radiance, [H, W, 3], always of the same v."""
        self._append(frame, tone_map(frame, self._exposure))

    def _measure(self, changes: Pictures, means: Pictures) -> dict[str, Tensor]:
        f, sf = changes
        # A network's radiance may be slightly negative.
        return {"srgb": sf.abs(), "relative": f.abs() / (means[0].clamp(min=0) + self._epsilon)}
