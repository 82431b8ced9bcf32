"""What is measured, as a named object: results of two protocols are never compared."""

import hashlib
import json
import math
from dataclasses import asdict, dataclass

import torch
from torch import Tensor
from torch.quasirandom import SobolEngine

from ngi.render.protocol import Renderer

SETS = ("hard", "uniform")
"""The two sets of test frames: the scene's hard frames, and v spread evenly over [0, 1]^D."""

METRICS = ("mape", "dssim", "mae", "lpips")
"""The paper's four metrics (Sec. 7.2.1), in the order of every table."""

DEFINITIONS = 1
"""Counts changes of the metrics' formulas; part of a protocol's identity."""

SMALLEST_RESOLUTION = 32
"""Pixels; of smaller images LPIPS's AlexNet pools everything away."""


FLOATS = ("target_noise", "epsilon", "exposure", "ssim_sigma")
"""Those numbers of a protocol that need not be whole."""


@dataclass(frozen=True, kw_only=True)
class EvaluationProtocol:
    """Every number that decides what a metric's value means.

    name: what tables call it; a changed number wants a changed name
    resolution: width and height in pixels of every test frame
    low_discrepancy_frames: number of frames of the set "uniform"
    target_noise: mean relative standard error at which a reference is good enough
    samples_per_pass: samples per pixel by which each half of a reference grows
    maximum_samples: samples per pixel of both halves together at which a reference stops anyway
    epsilon: of the relative errors |d| / (reference + epsilon), linear radiance
    exposure: stops; tone mapping multiplies radiance by 2^exposure
    ssim_window, ssim_sigma: side in pixels (odd) and standard deviation of SSIM's Gaussian window
    sobol_seed: of the scrambling of the low-discrepancy set

    Raises ValueError for values that cannot be measured with.
    """

    name: str
    resolution: int
    low_discrepancy_frames: int
    target_noise: float
    samples_per_pass: int
    maximum_samples: int
    epsilon: float = 0.01
    exposure: float = 0.0
    ssim_window: int = 11
    ssim_sigma: float = 1.5
    sobol_seed: int = 0

    def __post_init__(self) -> None:
        for key in FLOATS:  # or 1 and 1.0 were two protocols
            object.__setattr__(self, key, float(getattr(self, key)))
        for key, lowest in (
            ("resolution", self.smallest_resolution),
            ("low_discrepancy_frames", 1),
            ("samples_per_pass", 1),
            ("maximum_samples", 2 * self.samples_per_pass),
            ("ssim_window", 1),
        ):
            if getattr(self, key) < lowest:
                raise ValueError(self._message(key, f"at least {lowest}"))
        for key in FLOATS:
            if not math.isfinite(getattr(self, key)):
                raise ValueError(self._message(key, "a finite number"))
        for key in ("target_noise", "epsilon", "ssim_sigma"):
            if not getattr(self, key) > 0:
                raise ValueError(self._message(key, "more than 0"))
        if self.ssim_window % 2 == 0:
            raise ValueError(self._message("ssim_window", "odd"))

    @property
    def smallest_resolution(self) -> int:
        """Pixels a side of an image that every metric can be measured on."""
        return max(SMALLEST_RESOLUTION, self.ssim_window)

    def _message(self, key: str, expected: str) -> str:
        return (
            f"evaluation protocol '{self.name}': {key} is {getattr(self, key)}, "
            f"it has to be {expected}"
        )

    @property
    def identity(self) -> str:
        """16 hexadecimal digits of a hash over every field and the metrics' definitions."""
        content = json.dumps({**asdict(self), "definitions": DEFINITIONS}, sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()[:16]

    @property
    def reference_settings(self) -> dict[str, float]:
        """The fields that decide a reference image; protocols that share them share references."""
        return {
            "resolution": self.resolution,
            "epsilon": self.epsilon,
            "target_noise": self.target_noise,
            "samples_per_pass": self.samples_per_pass,
            "maximum_samples": self.maximum_samples,
        }


@dataclass(frozen=True)
class Frame:
    """One test image.

    set: "hard" or "uniform"
    index: its number within the set, from 0
    scene_vector: [D] float32, v in [0, 1]^D
    """

    set: str
    index: int
    scene_vector: Tensor


def evaluation_frames(renderer: Renderer, protocol: EvaluationProtocol) -> tuple[Frame, ...]:
    """The scene's hard frames (paper, Sec. 7.2.1), then the low-discrepancy set.

    The latter are the first points of a scrambled Sobol sequence over [0, 1]^D: they stand for the
    mean over all configurations, which the hard frames of a path do not. Of more variables than
    there are Sobol sequences for (21,201) they are independent.
    Raises ValueError for hard frames whose length is not the scene's D.
    """
    hard = renderer.hard_frames()
    if hard.ndim != 2 or hard.shape[1] != renderer.dimensions:
        raise ValueError(
            f"hard frames of shape {list(hard.shape)}: the scene has {renderer.dimensions} "
            f"variables, so [n, {renderer.dimensions}] is expected"
        )
    uniform = _spread(
        protocol.low_discrepancy_frames, renderer.dimensions, seed=protocol.sobol_seed
    )
    return tuple(
        Frame(set=name, index=index, scene_vector=v.detach().cpu().float())
        for name, vectors in (("hard", hard), ("uniform", uniform))
        for index, v in enumerate(vectors)
    )


def _spread(count: int, dimensions: int, *, seed: int) -> Tensor:
    """[count, dimensions] in [0, 1]."""
    if dimensions > SobolEngine.MAXDIM:
        return torch.rand(count, dimensions, generator=torch.Generator().manual_seed(seed))
    return SobolEngine(dimensions, scramble=True, seed=seed).draw(count)
