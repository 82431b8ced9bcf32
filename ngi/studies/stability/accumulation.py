"""Means over very many samples."""

from __future__ import annotations

import torch

from ngi.studies.stability.backends import BACKENDS
from ngi.studies.stability.case import Case, Conditions, Outcome
from ngi.studies.stability.rooms import FLOOR, LAMP, MOVING, RESOLUTION, SKY, Room, ball

OVER = {"backend": tuple(b for b in BACKENDS if b != "scalar")}
"""The scalar variant would take minutes, and sums pixel by pixel as the others do."""

RADIANCE = 0.1
"""Of the sky: a number that no sum of floats holds exactly."""

BRIGHTNESS = {"object": "sky", "property": "intensity", "minimum": 1, "maximum": 2}
PARTS, LONG = 50, 100_000
PIXELS = 4


def _constant(conditions: Conditions, *, samples: int, image: bool) -> Outcome:
    """Every sample is the same, so that the mean is too; all that differs is rounding."""
    room = Room(shapes=SKY.format(radiance=RADIANCE), variables=(BRIGHTNESS,))
    with room.renderer(conditions.backend, samples=samples) as renderer:
        if image:
            radiance = renderer.render_image(
                torch.zeros(1), resolution=1, samples_per_pixel=samples, seed=0
            ).double()
        else:
            patches = renderer.render_patches(torch.zeros(1, 3), resolution=RESOLUTION, seed=0)
            radiance = torch.expm1(patches.log_radiance.double())
    return Outcome(
        finite=bool(radiance.isfinite().all()),
        error=float((radiance / RADIANCE - 1).abs().max()),
        limit=1e-5,
        done="summed in blocks and passes",
    )


def _in_passes(conditions: Conditions) -> Outcome:
    """A reference of 1e5 samples against the mean of 50 of 2,000: the difference, in sigmas."""
    shapes = FLOOR + ball() + LAMP.format(radiance=10, half=0.3)
    with Room(shapes=shapes, variables=(MOVING,)).renderer(conditions.backend, samples=16) as made:
        v = torch.full((3,), 0.5)

        def image(samples: int, seed: int) -> torch.Tensor:
            return made.render_image(
                v, resolution=PIXELS, samples_per_pixel=samples, seed=seed
            ).double()

        long = image(LONG, 0)
        parts = torch.stack([image(LONG // PARTS, 1 + seed) for seed in range(PARTS)])
    # Both have the same variance, which the scatter of the parts tells.
    deviation = parts.std(dim=0) * (2 / PARTS) ** 0.5
    sigmas = ((long - parts.mean(dim=0)).abs() / deviation.clamp_min(1e-12)).max()
    return Outcome(
        finite=bool(long.isfinite().all()),
        error=float(sigmas),
        limit=4.5,  # the largest of 48
        done="summed in passes, in double precision",
    )


CASES = (
    Case(
        "1e7 samples in a patch",
        lambda conditions: _constant(conditions, samples=10_000, image=False),
        OVER,
    ),
    Case(
        "1e7 samples in a pixel",
        lambda conditions: _constant(conditions, samples=10_000_000, image=True),
        OVER,
    ),
    Case("1e5 samples per pixel in passes", _in_passes, OVER),
)
