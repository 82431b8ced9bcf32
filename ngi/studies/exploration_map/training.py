"""One run of the map: the program's own parts, without Lightning's trainer and without a disk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig

from ngi import learn
from ngi.config.build import build_module, build_samples, build_stream, plain
from ngi.config.configuration import composed
from ngi.explore import MarkovChains
from ngi.render import PocketRenderer
from ngi.studies.exploration_map.known_pockets import KnownPockets
from ngi.studies.exploration_map.plan import Plan
from ngi.studies.exploration_map.setting import (
    KNOWN,
    KNOWN_SHARE,
    NO_REUSE,
    SELF_TUNING,
    Method,
    Setting,
)
from ngi.studies.exploration_map.test_set import TestSet

PARTS = (
    *("data", "sampler", "reuse", "resolution", "model", "loss", "optimizer", "schedule"),
    *("averaging", "renderer"),
)
"""Of the program's configuration, that a run of the map is built from."""


@lru_cache
def configuration(
    method: Method, learner: tuple[str, ...] = (), reuse: tuple[str, ...] = SELF_TUNING
) -> DictConfig:
    """The program's configuration for a method; what settings change is not in it.

    learner, reuse: see `Plan`
    """
    of_reuse = reuse if method.reuse else NO_REUSE
    return composed("experiment=exploration_map", *learner, *method.overrides, *of_reuse)


def plain_configuration(method: Method, plan: Plan) -> dict[str, Any]:
    """The parts of it that a run of a plan is built from, as plain data."""
    config = configuration(method, plan.learner, plan.reuse)
    return {part: plain(config[part]) for part in PARTS}


@lru_cache(maxsize=1)
def _scene(setting: Setting, plan: Plan) -> tuple[PocketRenderer, TestSet]:
    config = configuration(Method("uniform", reuse=False), plan.learner)
    renderer = instantiate(config.renderer, **setting.scene)
    return renderer, TestSet(renderer, frames=plan.frames)


def train(
    setting: Setting, method: Method, seed: int, plan: Plan, *, folder: Path
) -> Iterator[dict[str, Any]]:
    """Trains and gives a row per evaluation: setting, method, seed, what was done, the errors.

    folder: for the step guard's report, if there is one
    generated_batches, scored_batches: batches rendered, and those whose proposals and current
        states were scored, or whose states were drawn by their predicted losses
    lit: mean over the samples trained on of how far the scene's effects are switched on; for
        samples that are uniform it is the volume
    """
    config = configuration(method, plan.learner, plan.reuse).copy()
    config.seed, config.model.hidden_features = seed, setting.hidden_features
    renderer, test_set = _scene(setting, plan)
    clock = learn.PhaseClock()
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(  # its patches are not written
        config, renderer=renderer, samples=samples, clock=clock, patches=Path()
    )
    if method.sampler in KNOWN:
        assert isinstance(stream.sampler, MarkovChains)
        stream.sampler.proposal = KnownPockets(
            renderer=renderer, share=KNOWN_SHARE, weighted=KNOWN[method.sampler]
        )
    module = build_module(config, samples=samples, stream=stream, folder=folder)
    optimizer = module.configure_optimizers()
    network = module.network if module.averaged is None else module.averaged.module
    schedule = instantiate(config.schedule)
    rates = learn.BaseRates(optimizer)
    lit = 0.0
    for step, batch in enumerate(islice(stream, plan.steps), start=1):
        lit += renderer.weights(batch.patches.scene_vector).sum(dim=1).mean().item()
        rates.scale(schedule.factor(steps=step - 1, used=(step - 1) / plan.steps))
        learn.training_step(batch, module.learner, optimizer=optimizer)
        if step % (plan.steps // plan.evaluations) == 0:
            counters = stream.counters
            asked = counters.generated_batches if method.predicts else counters.scored_batches
            yield {
                **asdict(setting),
                **asdict(method),
                "seed": seed,
                "step": step,
                "generated_batches": counters.generated_batches,
                "scored_batches": asked,
                "lit": lit / step,
                **test_set.errors(network),
            }
