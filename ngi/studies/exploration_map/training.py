"""One run of the map: the program's own parts, without Lightning's trainer and without a disk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from ngi import learn
from ngi.config.build import build_module, build_samples, build_stream, plain
from ngi.config.configuration import composed
from ngi.render import PocketRenderer
from ngi.studies.exploration_map.plan import Plan
from ngi.studies.exploration_map.setting import Method, Setting
from ngi.studies.exploration_map.test_set import TestSet

PARTS = ("sampler", "reuse", "resolution", "model", "loss", "optimizer", "renderer")
"""Of the program's configuration, that a run of the map is built from."""


@lru_cache
def configuration(method: Method) -> DictConfig:
    """The program's configuration for a method; what settings change is not in it."""
    return composed("experiment=exploration_map", *method.overrides)


def plain_configuration(method: Method) -> dict[str, Any]:
    """The parts of it that a run is built from, as plain data."""
    return plain(OmegaConf.masked_copy(configuration(method), list(PARTS)))


@lru_cache(maxsize=1)
def _scene(setting: Setting, frames: int) -> tuple[PocketRenderer, TestSet]:
    renderer = instantiate(configuration(Method("uniform", reuse=False)).renderer, **setting.scene)
    return renderer, TestSet(renderer, frames=frames)


def train(setting: Setting, method: Method, seed: int, plan: Plan) -> Iterator[dict[str, Any]]:
    """Trains and gives a row per evaluation: setting, method, seed, what was done, the errors.

    generated_batches, scored_batches: batches rendered, and those whose proposals and current
        states were scored
    lit: mean over the samples trained on of how far the scene's effects are switched on; for
        samples that are uniform it is the volume
    """
    config = configuration(method).copy()
    config.seed, config.model.hidden_features = seed, setting.hidden_features
    renderer, test_set = _scene(setting, plan.frames)
    clock = learn.PhaseClock()
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(config, samples=samples, clock=clock, patches=Path())  # not written
    module = build_module(config, samples=samples, stream=stream, folder=Path())
    optimizer = module.configure_optimizers()
    lit = 0.0
    for step, batch in enumerate(islice(stream, plan.steps), start=1):
        lit += renderer.weights(batch.patches.scene_vector).sum(dim=1).mean().item()
        learn.training_step(batch, module.learner, optimizer=optimizer)
        if step % (plan.steps // plan.evaluations) == 0:
            yield {
                **asdict(setting),
                **asdict(method),
                "seed": seed,
                "step": step,
                "generated_batches": stream.counters.generated_batches,
                "scored_batches": stream.counters.scored_batches,
                "lit": lit / step,
                **test_set.errors(module.network),
            }
