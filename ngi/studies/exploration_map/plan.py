"""Which settings are run, and how long each run is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

from ngi.studies.exploration_map.setting import Setting

VOLUMES = (1e-1, 1e-2, 1e-3, 1e-4)
NOT_RARE = 0.3
"""A volume at which uniform sampling meets the effects in every batch."""

DIMENSIONS = (2, 8, 128)
BASE = Setting()


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Settings, and the size of their runs.

    steps: training steps of a run; evaluations: how often it is tested, evenly
    frames: scene vectors of the test set
    """

    settings: tuple[Setting, ...]
    steps: int
    evaluations: int
    frames: int


def _full() -> tuple[Setting, ...]:
    """Two grids, volume by dimensions and by noise, and every other knob alone."""
    settings = [
        BASE,
        *(_in_dimensions(d, volume) for d, volume in product(DIMENSIONS, VOLUMES)),
        *(_in_dimensions(d, NOT_RARE) for d in DIMENSIONS[:2]),
        _in_dimensions(32, BASE.volume),
        *(replace(BASE, volume=volume, noise=1.0) for volume in VOLUMES[:-2]),
        *(replace(BASE, active=active) for active in (2, 8)),
        replace(BASE, pockets=16),
        replace(BASE, sharpness=1.0),
        *(replace(BASE, hidden_features=features) for features in (16, 128)),
    ]
    return tuple(dict.fromkeys(settings))


def _in_dimensions(dimensions: int, volume: float) -> Setting:
    active = min(BASE.active, dimensions)
    return replace(BASE, volume=volume, dimensions=dimensions, active=active)


PLANS = {
    "smoke": Plan(
        settings=(BASE, replace(BASE, volume=0.1, dimensions=2, active=2)),
        steps=24,
        evaluations=2,
        frames=40,
    ),
    "full": Plan(settings=_full(), steps=500, evaluations=20, frames=400),
}
