"""What can be seen of one configuration: the network's picture, the buffers, a path-traced one."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from time import perf_counter

import torch
from torch import Tensor

from ngi.evaluate.metrics import radiance_of
from ngi.render import Renderer

Predict = Callable[..., Tensor]
"""(buffers [H, W, C], v [D], preview=whether less may do) -> log1p of linear radiance [H, W, 3]."""

PASS_SAMPLES = 8
"""Samples per pixel of one pass of the path-traced picture."""


@dataclass(frozen=True)
class Place:
    """Where to look: v, pixels a side, and rays per pixel of the buffers.

    rays: None for the scene's number; any other makes a preview
    """

    v: tuple[float, ...]
    resolution: int
    rays: int | None = None

    def tensor(self) -> Tensor:
        """[D]."""
        return torch.tensor(self.v)


@dataclass
class SceneView:
    """One configuration at one resolution, each part computed when it is first asked for.

    seconds: by part, of its last computation: buffers, network, paths
    samples: per pixel of `reference` so far

    `_total`, [2, H, W, 3], sums the even passes and the odd ones, `_finite`, [2, H, W, 1], counts
    how many of them were finite.
    """

    place: Place
    renderer: Renderer
    predict: Predict
    seconds: dict[str, float] = field(default_factory=dict)
    samples: int = 0
    _buffers: Tensor | None = None
    _prediction: Tensor | None = None
    _total: Tensor | None = None
    _finite: Tensor | None = None

    def has(self, parts: Iterable[str]) -> bool:
        """Whether all of these are computed; parts: as `seconds` names them."""
        computed = {"buffers": self._buffers, "network": self._prediction, "paths": self._total}
        return all(computed[part] is not None for part in parts)

    @property
    def buffers(self) -> Tensor:
        """[H, W, C] on the CPU."""
        if self._buffers is None:
            self._buffers = self._timed("buffers", self._render_buffers)
        return self._buffers

    @property
    def prediction(self) -> Tensor:
        """[H, W, 3] linear radiance; negative where the network says so."""
        if self._prediction is None:
            buffers, preview = self.buffers, self.place.rays is not None
            self._prediction = self._timed(
                "network",
                lambda: radiance_of(self.predict(buffers, self.place.tensor(), preview=preview)),
            )
        return self._prediction

    @property
    def reference(self) -> Tensor:
        """[H, W, 3] linear radiance: the mean over all passes, the first of which it does itself.

        A pass's pixels that are NaN or Inf are left out, as in the test frames' references.
        """
        if self._total is None:
            self.trace()
        assert self._total is not None
        assert self._finite is not None
        return (self._total.sum(dim=0) / self._finite.sum(dim=0)).float()

    @property
    def noise(self) -> Tensor | None:
        """[H, W, 3]: about as far as `reference` is off; None where it has a single pass.

        Half of the difference between the means of the even passes and of the odd ones; 0 where
        one of the two has no finite pixel.
        """
        if self._total is None or self._finite is None or self.samples < 2 * PASS_SAMPLES:
            return None
        means = self._total / self._finite
        return (0.5 * (means[0] - means[1])).nan_to_num(0.0, 0.0, 0.0).float()

    def trace(self) -> None:
        """Adds a pass to the reference."""
        radiance = self._timed("paths", self._trace_pass)
        finite = radiance.isfinite().all(dim=-1, keepdim=True)
        if self._total is None or self._finite is None:
            self._total = radiance.new_zeros(2, *radiance.shape)
            self._finite = radiance.new_zeros(2, *finite.shape)
        half = self.samples // PASS_SAMPLES % 2
        self._total[half] += torch.where(finite, radiance, 0.0)
        self._finite[half] += finite
        self.samples += PASS_SAMPLES

    def forget_prediction(self) -> None:
        """The network has changed."""
        self._prediction = None

    def _render_buffers(self) -> Tensor:
        return self.renderer.image_buffers(
            self.place.tensor(), resolution=self.place.resolution, samples=self.place.rays
        ).cpu()

    def _trace_pass(self) -> Tensor:
        radiance = self.renderer.render_image(
            self.place.tensor(),
            resolution=self.place.resolution,
            samples_per_pixel=PASS_SAMPLES,
            seed=self.samples // PASS_SAMPLES,
        )
        return radiance.cpu().double()

    def _timed(self, part: str, compute: Callable[[], Tensor]) -> Tensor:
        begin = perf_counter()
        result = compute()
        self.seconds[part] = perf_counter() - begin
        return result
