"""Trains one run from a Hydra configuration: `python -m ngi.train --help`."""

from __future__ import annotations

import logging
import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hydra
from hydra.core.config_store import ConfigStore
from hydra.errors import CompactHydraException
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

import ngi
from ngi.memory import keep_freed_memory
from ngi.precision import fast_precision
from ngi.resources import cache_folder, root
from ngi.run_name import run_name
from ngi.scene import scenes

if TYPE_CHECKING:
    from ngi.learn import Budget, RunFolder, Tracker
    from ngi.render import Renderer

log = logging.getLogger(__name__)

NOT_IDENTITY = (
    "run",
    "tracker",
    "label",
    "renderer.scene",
    "renderer.workers",
    "renderer.cluster",
    "evaluation.evaluator.cache",
    "evaluation.evaluator.lpips",
)
"""Parts of the configuration that do not decide what a run computes: names, places, helpers."""


def train(config: DictConfig) -> dict[str, Any]:
    """Runs, or resumes, the run that `config` describes and returns its result.

    A finished run is not run again. Raises ValueError for a configuration, scene, folder or
    checkpoint that does not fit, before any long work.
    """
    from ngi import learn  # PyTorch and Lightning take seconds that --help need not wait for

    keep_freed_memory()
    budget = instantiate(config.budget)
    renderer = instantiate(config.renderer)
    settings = _settings(config, scene_hash=renderer.scene_hash)
    folder = learn.RunFolder(Path(config.run.folder), settings=settings)
    tracker = instantiate(config.tracker)
    try:
        if folder.result is not None:
            log.info("%s is finished already; delete the folder to run it again", folder.path)
            return folder.result
        return _train(config, budget=budget, renderer=renderer, folder=folder, tracker=tracker)
    finally:
        with ExitStack() as stack:  # closes each, whatever happens in the others
            stack.callback(renderer.close)
            stack.callback(folder.close)
            stack.callback(tracker.finish, failed=sys.exc_info()[0] is not None)


def _train(
    config: DictConfig, *, budget: Budget, renderer: Renderer, folder: RunFolder, tracker: Tracker
) -> dict[str, Any]:
    from ngi import learn
    from ngi.patches import Patches

    clock = learn.PhaseClock()
    stream = learn.TrainingStream(
        renderer=renderer,
        sampler=instantiate(config.sampler),
        store=instantiate(config.reuse.store)(layout=renderer.layout),
        archive=learn.PatchArchive(folder.patches),
        policy=instantiate(config.reuse.policy),
        schedule=instantiate(config.resolution),
        clock=clock,
        seed=config.seed,
        when_late=config.reuse.when_late,
    )
    module = learn.IlluminationModule(
        network=learn.seeded(instantiate(config.model), seed=config.seed)(
            layout=renderer.layout, scene_dimensions=renderer.dimensions
        ),
        loss=instantiate(config.loss),
        optimizer=instantiate(config.optimizer),
        target=stream.sampler.target,
        clock=clock,
    )
    recorder = learn.Recorder(
        evaluator=instantiate(config.evaluation.evaluator)(renderer=renderer),
        predict=module.predict,
        folder=folder,
        stream=stream,
        clock=clock,
        tracker=tracker,
        label={**_plain(config.label), "seed": config.seed},
        backend=renderer.description,
    )
    trainer = instantiate(config.trainer)(
        default_root_dir=folder.path,
        max_steps=budget.maximum_steps,
        callbacks=learn.callbacks(
            stream=stream,
            clock=clock,
            folder=folder,
            tracker=tracker,
            budget=budget,
            recorder=recorder,
            evaluations=config.evaluation.count,
            checkpoint_seconds=config.run.checkpoint_seconds,
            checkpoint_steps=config.run.checkpoint_steps,
        ),
        plugins=[learn.AtomicCheckpointIO(identity=folder.identity)],
    )
    datamodule = learn.ExplorationDataModule(stream=stream)
    module.rehearse(
        Patches.blank(
            2,
            layout=renderer.layout,
            dimensions=renderer.dimensions,
            patch_size=renderer.patch_size,
        )
    )
    checkpoint = learn.prepare_resume(folder)
    folder.begin()
    recorder.prepare()
    renderer.warm_up()
    trainer.fit(module, datamodule, ckpt_path=checkpoint, weights_only=True)
    module.to(trainer.strategy.root_device)  # Lightning has taken it back to the CPU
    return recorder.finish()


def _plain(config: DictConfig) -> dict[str, Any]:
    plain = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    assert isinstance(plain, dict)
    return {str(key): value for key, value in plain.items()}


def _settings(config: DictConfig, *, scene_hash: str) -> dict[str, Any]:
    """What decides the result. The scene counts by its content, not by where it lies."""
    settings = _plain(config)
    for key in NOT_IDENTITY:
        *path, last = key.split(".")
        parent = settings
        for part in path:
            parent = parent[part]
        parent.pop(last, None)
    settings["scene"] = {"name": config.scene.name, "hash": scene_hash}
    settings["version"] = ngi.__version__
    return settings


def register() -> None:
    """Makes scene folders options of the group `scene`, and the resolvers known to OmegaConf."""
    os.environ["NGI_ROOT"] = str(root())
    store = ConfigStore.instance()
    for name, arguments in scenes().items():
        reader = {"_target_": "ngi.scene.read_scene", **arguments}
        store.store(group="scene", name=name, node={"name": name, "reader": reader})
    OmegaConf.register_new_resolver("run_name", run_name, replace=True)
    OmegaConf.register_new_resolver("fast_precision", fast_precision, replace=True)
    OmegaConf.register_new_resolver("folder_name", lambda path: Path(path).name, replace=True)
    OmegaConf.register_new_resolver("cache_folder", lambda: str(cache_folder()), replace=True)


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> None:
    try:
        result = train(config)
    except (ValueError, OSError, RuntimeError, FloatingPointError, TypeError) as error:
        # Hydra reports only the first failed job of a sweep: each says for itself what was wrong,
        # in its own log too; the traceback is for those who ask for it.
        log.error("%s", error)
        log.debug("traceback", exc_info=True)
        raise CompactHydraException(str(error)) from error
    hard = result["metrics"]["hard"]
    log.info(
        "%s: %s",
        config.run.folder,
        ", ".join(f"{name} {value['mean']:.4g}" for name, value in hard.items() if value),
    )


def main() -> None:
    """Entry point of `python -m ngi.train` and `ngi-train`."""
    register()
    _main()


if __name__ == "__main__":
    main()
