"""Which settings are run, and how long each run is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

from ngi.studies.exploration_map.setting import (
    AT_MOST,
    BY_LOSS,
    BY_SAMPLES,
    CHAINS,
    EAGER,
    METHODS,
    OURS,
    SELF_TUNING,
    UNIFORM,
    Method,
    Setting,
)

VOLUMES = (1e-1, 1e-2, 1e-3, 1e-4)
NOT_RARE = 0.3
"""A volume at which uniform sampling meets the effects in every batch."""

DIMENSIONS = (2, 8, 128)
BASE = Setting()


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Settings, methods, and the size of their runs.

    steps: training steps of a run; evaluations: how often it is tested, evenly
    frames: scene vectors of the test set
    learner: what all runs change in the program's configuration
    reuse: what those that reuse patches change besides
    """

    settings: tuple[Setting, ...]
    steps: int
    evaluations: int
    frames: int
    methods: tuple[Method, ...] = METHODS
    learner: tuple[str, ...] = ()
    reuse: tuple[str, ...] = SELF_TUNING


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


OUR_LEARNER = ("optimizer=muon", "schedule=warmup_stable_decay", "averaging=exponential")
"""Of `method=ours`, all that does not concern the samples or what the network sees of them."""


NOISE_KNOWN = ("renderer.halves=true", "renderer.samples_per_pixel=2")
"""Each patch is the mean of two samples: predictions are made of losses without its noise."""


FOR_LONG_RUNS = (replace(BASE, volume=0.001), _in_dimensions(32, BASE.volume))
"""Where the mean pays for eager predictions after 4,000 steps."""


def _ours() -> tuple[Setting, ...]:
    """Where exploration pays by the full map: volume, dimensions and noise, each alone."""
    return (BASE, *FOR_LONG_RUNS, replace(BASE, noise=1.0))


OURS_LONG = Plan(
    settings=(*_ours(), replace(BASE, volume=0.1), _in_dimensions(2, BASE.volume)),
    steps=4000,
    evaluations=40,
    frames=400,
    methods=OURS,
    learner=(*OUR_LEARNER, *NOISE_KNOWN),
    reuse=BY_SAMPLES,
)

LONGER = replace(OURS_LONG, settings=FOR_LONG_RUNS, steps=16000)

PLANS = {
    "smoke": Plan(
        settings=(BASE, replace(BASE, volume=0.1, dimensions=2, active=2)),
        steps=24,
        evaluations=2,
        frames=40,
    ),
    "full": Plan(settings=_full(), steps=500, evaluations=20, frames=400),
    **{
        f"known_{steps}": Plan(
            settings=(BASE,),
            steps=steps,
            evaluations=20,
            frames=400,
            methods=AT_MOST,
            learner=OUR_LEARNER,
        )
        for steps in (500, 2000)
    },
    "ours": Plan(
        settings=_ours(),
        steps=1000,
        evaluations=20,
        frames=400,
        methods=OURS,
        learner=OUR_LEARNER,
    ),
    "ours_long": OURS_LONG,
    "ours_by_loss": replace(
        OURS_LONG, methods=tuple(method for method in OURS if method.reuse), reuse=BY_LOSS
    ),
    "ours_chains": replace(OURS_LONG, methods=CHAINS),
    "ours_eager": replace(OURS_LONG, methods=(Method(EAGER, reuse=True),), reuse=BY_LOSS),
    "ours_longer": replace(LONGER, methods=(Method(UNIFORM, reuse=True),)),
    "ours_eager_longer": replace(LONGER, methods=(Method(EAGER, reuse=True),), reuse=BY_LOSS),
}
