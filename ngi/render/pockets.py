"""Closed formulas with rare effects: a family of scenes in which everything rare has a knob."""

from math import pi, sqrt
from typing import Unpack

import torch
from torch import Tensor

from ngi.patches import BufferLayout
from ngi.render.closed_form import ClosedFormRenderer, Sampling, spread_points, spread_weights

FORMULA_VERSION = 1
"""Counts changes of what the formulas give; part of the scene's hash."""

LARGEST_VOLUME = 0.5
MOST_ACTIVE = 4
"""Active variables where none are asked for; fewer where the scene has fewer."""

AMBIENT, SPOT, SPOT_RADIUS = 0.2, 3.0, 0.25
BRIGHTNESS, REGION_RADIUS = 8.0, 0.35
"""Of an effect; radii are standard deviations, in units of the image's side."""
DIRECTION = (0.8, 0.6)
"""Across an effect's stripes, of which there is one along the image's side."""
MOVED = 0.25
"""Periods by which stripes move while v crosses a pocket along all its sides, about."""
HARD_FRAMES = 10


class PocketRenderer(ClosedFormRenderer):
    """A spot on the unit square, on which rare effects light up: one in each pocket of [0, 1]^D.

    Without them only the albedo depends on v, smoothly and on every component, and the buffers
    tell it, so that it is soon learnt:

        radiance(p) = albedo(v) * (AMBIENT + SPOT * exp(-|p - 1/2|^2 / (2 SPOT_RADIUS^2)))

    A pocket is a box on the torus of the first A = `active` variables, whatever the others are;
    all boxes are cubes of the same side s. The weight of an effect is the product over the active
    variables of a soft box function of d, the distance to the pocket's centre on the torus,

        w(d) = smoothstep((s/2 - |d|) / e + 1/2),   e = (1 - sharpness) * min(s, 1 - s),

    which is 1/2 at the box's border and integrates to s whatever the sharpness. So `volume`, the
    mean over [0, 1]^D of the sum of all weights, is pockets * s^A. The effect adds

        BRIGHTNESS * w(v) * exp(-|p - g|^2 / (2 REGION_RADIUS^2)) * stripes(p, v)

    around a place g of the image. Its colours have stripes of their own, which move while v
    crosses the pocket, so that one sample does not tell all of it. The buffers show nothing of
    it. The variables that are not active change the albedo only.

    volume: in (0, 0.5]. pockets: at least 1. sharpness: in [0, 1]; 1 switches effects on and off
    at the border. active: A, from 1 to D; None for 4, or D where that is less.
    sampling: samples_per_pixel, halves, noise; they and other arguments are those of
    `ClosedFormRenderer`. The buffers are position and albedo.
    Raises ValueError for numbers out of range.
    """

    def __init__(
        self,
        *,
        dimensions: int,
        volume: float,
        pockets: int,
        sharpness: float,
        patch_size: int,
        active: int | None = None,
        **sampling: Unpack[Sampling],
    ) -> None:
        active = min(dimensions, MOST_ACTIVE) if active is None else active
        layout = BufferLayout(("position", "albedo"))
        super().__init__(
            dimensions=dimensions,
            patch_size=patch_size,
            **sampling,
            layout=layout,
            formula=("pockets", FORMULA_VERSION, volume, pockets, float(sharpness), active),
        )
        if not 0 < volume <= LARGEST_VOLUME:
            raise ValueError(
                f"renderer.volume is {volume}; expected more than 0 and at most {LARGEST_VOLUME}"
            )
        if pockets < 1:
            raise ValueError(f"renderer.pockets is {pockets}; expected at least 1")
        if not 0 <= sharpness <= 1:
            raise ValueError(f"renderer.sharpness is {sharpness}; expected 0 to 1")
        if not 1 <= active <= dimensions:
            raise ValueError(
                f"renderer.active is {active}; expected 1 to renderer.dimensions, {dimensions}"
            )
        self.pockets = pockets
        self.active = active
        self.side = (volume / pockets) ** (1 / active)
        self.centres = spread_points(pockets, active)
        """[pockets, A] in [0, 1)."""
        self._edge = (1 - sharpness) * min(self.side, 1 - self.side)
        self._places = 0.25 + 0.5 * spread_points(pockets, 2)
        self._albedo_weights = spread_weights(3, dimensions)
        self._moved = MOVED * spread_weights(3, active) / sqrt(active)

    def hard_frames(self) -> Tensor:
        """[10, D]: points within the pockets, taking turns."""
        return self.into_pockets(spread_points(HARD_FRAMES, self.dimensions))

    def into_pockets(self, points: Tensor) -> Tensor:
        """Takes point i of [n, D] in [0, 1] into the box of pocket i mod `pockets`.

        Points that are uniform in the hypercube become uniform in the box.
        """
        centre = self.centres[torch.arange(len(points)) % self.pockets]
        moved = torch.frac(centre + self.side * (points[:, : self.active] - 0.5) + 1)
        return torch.cat([moved, points[:, self.active :]], dim=1)

    def boxes(self, scene_vectors: Tensor) -> Tensor:
        """[n]: how many pockets' boxes hold each v of [n, D]."""
        inside = self._offsets(scene_vectors).abs() <= self.side / 2
        count: Tensor = inside.all(-1).sum(1)
        return count

    def weights(self, scene_vectors: Tensor) -> Tensor:
        """[n, pockets]: how far each effect is switched on, in [0, 1], for v [n, D]."""
        return self._weights(self._offsets(scene_vectors))

    def shade(self, scene_vectors: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        phase = (scene_vectors[:, None] * self._albedo_weights).sum(-1) / sqrt(self.dimensions)
        albedo = (0.5 + 0.4 * torch.sin(2 * pi * phase))[:, None, None]
        radiance = albedo * (AMBIENT + SPOT * _gaussian(points - 0.5, SPOT_RADIUS))
        offsets = self._offsets(scene_vectors)
        weights = self._weights(offsets)
        for image, pocket in weights.nonzero().tolist():
            effect = self._effect(pocket, offsets[image, pocket], points[image])
            radiance[image] += weights[image, pocket] * effect
        position = torch.nn.functional.pad(points, (0, 1))
        return torch.cat([position, albedo.expand_as(position)], -1), radiance

    def _offsets(self, scene_vectors: Tensor) -> Tensor:
        """[n, pockets, A] in [-1/2, 1/2): from the pockets' centres to v on the torus."""
        return torch.frac(scene_vectors[:, None, : self.active] - self.centres + 1.5) - 0.5

    def _weights(self, offsets: Tensor) -> Tensor:
        inside = self.side / 2 - offsets.abs()
        if self._edge == 0:
            within: Tensor = (inside >= 0).all(-1)
            return within.float()
        ramp = (inside / self._edge + 0.5).clamp(0, 1)
        weights: Tensor = (ramp * ramp * (3 - 2 * ramp)).prod(-1)
        return weights

    def _effect(self, pocket: int, offset: Tensor, points: Tensor) -> Tensor:
        """[h, w, 3]: a pocket's effect at full weight; offset: [A], points: [h, w, 2]."""
        region = _gaussian(points - self._places[pocket], REGION_RADIUS)
        across = (points @ torch.tensor(DIRECTION))[..., None]
        moved = (self._moved * offset / self.side).sum(-1)  # [3], in periods
        return BRIGHTNESS * region * (0.5 + 0.5 * torch.cos(2 * pi * (across + moved)))


def _gaussian(offset: Tensor, radius: float) -> Tensor:
    """[..., 1] of [..., 2], 1 in the middle."""
    return torch.exp(-offset.square().sum(-1, keepdim=True) / (2 * radius**2))
