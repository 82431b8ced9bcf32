"""Light that is off, faint, blinding, or comes from next to nowhere."""

from __future__ import annotations

from functools import partial

import torch

from ngi.evaluate import dssim, mae, mape
from ngi.models import L1Dssim
from ngi.studies.stability.backends import BACKENDS
from ngi.studies.stability.case import Case, Conditions, Outcome
from ngi.studies.stability.rooms import FLOOR, LAMP, MOVING, Picture, Room, ball

OVER = {"backend": BACKENDS}
ORDINARY = 10.0
"""Radiance of the lamp."""

HALF = 0.3
"""Half its side, in metres."""


def _lit(backend: str | None, *, radiance: float = ORDINARY, half: float = HALF) -> Picture:
    """The room without what shows the lamp itself."""
    shapes = FLOOR + ball() + LAMP.format(radiance=radiance, half=half)
    return Room(shapes=shapes, variables=(MOVING,)).radiance(backend, 0.5, 0.5, 0.5)


def _off(conditions: Conditions) -> Outcome:
    """A black picture: no metric, loss or weight may divide by it."""
    picture = _lit(conditions.backend, radiance=0.0)
    black = picture.radiance.float()
    loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)(black[None], black[None])
    values = [mape(black, black, 0.01), mae(black, black), dssim(black, black), float(loss)]
    return Outcome(
        finite=picture.finite and bool(torch.tensor(values).isfinite().all()),
        error=float(black.max()) + max(map(abs, values)),
        limit=1e-6,
        done="black; metrics and loss are 0",
    )


def _scaled(conditions: Conditions, *, factor: float) -> Outcome:
    """Light is linear: the same seed gives the same picture, times the factor."""
    picture = _lit(conditions.backend, radiance=ORDINARY * factor)
    ordinary = _lit(conditions.backend).radiance
    shown = ordinary > 1e-3
    difference = (picture.radiance / factor - ordinary).abs() / ordinary.clamp_min(1e-3)
    return Outcome(
        finite=picture.finite,
        error=float(difference[shown].max()),
        limit=1e-3,
        done=picture.done,
    )


def _overflow(conditions: Conditions) -> Outcome:
    """Radiance near the end of float32: what overflows is masked, and nothing else is lost."""
    picture = _lit(conditions.backend, radiance=1e38)
    return Outcome(finite=picture.finite, done=picture.done)


def _small_lamp(conditions: Conditions, *, half: float) -> Outcome:
    """The same power from a smaller lamp; 0.5 mm is far below a pixel."""
    small = _lit(conditions.backend, radiance=ORDINARY * (0.01 / half) ** 2, half=half)
    ordinary = _lit(conditions.backend, radiance=ORDINARY, half=0.01)
    mean = ordinary.radiance.mean()
    return Outcome(
        finite=small.finite,
        error=float((small.radiance.mean() - mean).abs() / mean),
        limit=0.03,
        done=small.done,
    )


CASES = (
    Case("all lights off", _off, OVER),
    *(
        Case(f"intensity {factor:g}", partial(_scaled, factor=factor), OVER)
        for factor in (1e-6, 1e6)
    ),
    Case("firefly: a lamp of radiance 1e8", partial(_scaled, factor=1e7), OVER),
    Case("radiance 1e38", _overflow, OVER),
    *(
        Case(f"lamp of {2000 * half:g} mm", partial(_small_lamp, half=half), OVER)
        for half in (2.5e-3, 2.5e-4)
    ),
)
