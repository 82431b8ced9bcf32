"""A path through a scene as networks and path tracer show it, frame by frame, and how steady."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from ngi.evaluate.pictures import side_by_side, srgb_picture
from ngi.evaluate.temporal import Flicker, TemporalError
from ngi.view.mp4 import AddFrame
from ngi.view.path_traced_run import PathTracedRun
from ngi.view.trained_run import TrainedRun

Measured = dict[str, dict[str, float]]
"""Values by measure, by panel."""

Halves = tuple[Tensor, ...]
"""Two independent halves of the reference, [H, W, 3]; empty where there is none."""

FLOOR = "reference noise"
"""The temporal error that a perfect network would have."""


@dataclass(frozen=True)
class Film:
    """What is filmed.

    runs: of one scene; the first one's renderer traces the reference
    labels: of the runs, no two alike
    path: [T, D], a v per frame
    resolution: pixels a side
    samples: per pixel of the reference, an even number; 0 for none
    exposure: of the pictures, in stops
    """

    runs: Sequence[TrainedRun | PathTracedRun]
    labels: Sequence[str]
    path: Tensor
    resolution: int
    samples: int
    exposure: float

    @property
    def stands_still(self) -> bool:
        return bool((self.path == self.path[0]).all())

    def shoot(self, add_frame: AddFrame) -> Measured:
        """Renders, shows and measures every frame.

        The first run | the reference | the other runs. Returns the flicker of all of them where v
        stands still, else the runs' temporal errors; nothing where these have no reference.
        """
        protocol = self.runs[0].protocol
        numbers = {"epsilon": protocol.epsilon, "exposure": protocol.exposure}
        flicker: dict[str, Flicker] = defaultdict(lambda: Flicker(**numbers))
        errors: dict[str, TemporalError] = defaultdict(lambda: TemporalError(**numbers))
        for number, v in enumerate(tqdm(self.path, desc="frames", unit="frame")):
            networks = {
                label: run.radiance(v, resolution=self.resolution)
                for label, run in zip(self.labels, self.runs, strict=True)
            }
            halves = self._trace(v, number) if self.samples else ()
            panels = self._panels(networks, halves)
            if self.stands_still:
                for label, radiance in panels.items():
                    flicker[label].add(radiance)
            elif halves:
                for label, radiance in {**networks, FLOOR: halves[0]}.items():
                    errors[label].add(radiance, *halves)
            pictures = [srgb_picture(radiance, self.exposure) for radiance in panels.values()]
            add_frame(np.asarray(side_by_side(pictures, list(panels))))
        return {label: measure.result() for label, measure in (flicker | errors).items()}

    def _panels(self, networks: dict[str, Tensor], halves: Halves) -> dict[str, Tensor]:
        """What is shown, from left to right: linear radiance by label."""
        panels = list(networks.items())
        if halves:
            panels.insert(
                1, (f"path tracer, {self.samples:,} spp", torch.stack(halves).mean(dim=0))
            )
        return dict(panels)

    def _trace(self, v: Tensor, number: int) -> Halves:
        """Other ones for every frame.

        Where a path made a pixel NaN or Inf, it is the other half's.
        """
        a, b = (self._half(v, seed=2 * number + half) for half in (0, 1))
        finite_a, finite_b = (x.isfinite().all(dim=-1, keepdim=True) for x in (a, b))
        return torch.where(finite_a, a, b), torch.where(finite_b, b, a)

    def _half(self, v: Tensor, *, seed: int) -> Tensor:
        radiance = self.runs[0].renderer.render_image(
            v, resolution=self.resolution, samples_per_pixel=self.samples // 2, seed=seed
        )
        return radiance.cpu()
