"""Trains one run from a Hydra configuration: `ngi train --help`."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import CompactHydraException
from hydra.utils import instantiate
from omegaconf import DictConfig

from ngi.build import build_module, build_samples, build_stream, plain, run_costs
from ngi.config_values import check_values
from ngi.configuration import register, run_settings, scene_place
from ngi.energy import EnergyMeter, energy_counters
from ngi.memory import keep_freed_memory
from ngi.provenance import code_commit
from ngi.resources import root

if TYPE_CHECKING:
    from ngi import learn
    from ngi.learn.lightning_api import Callback, Trainer
    from ngi.render import Renderer
    from ngi.view.live import LiveView

log = logging.getLogger(__name__)

MESSAGES = (ValueError, OSError, RuntimeError, FloatingPointError, TypeError)
"""Exceptions whose text says to users what is wrong; all others are bugs."""


def train(config: DictConfig) -> dict[str, Any]:
    """Runs, or resumes, the run that `config` describes and returns its result.

    Where it says `path_tracing`, that takes the network's place and nothing is trained. A finished
    run is not run again. Raises ValueError for a configuration, scene, folder or checkpoint that
    does not fit, before any long work; `Interrupted` after SIGTERM or SIGINT.
    """
    from ngi import learn  # PyTorch and Lightning take seconds that --help need not wait for

    keep_freed_memory()
    check_values(config)
    with learn.Interruption(of=config.run.folder) as interruption:
        budget = instantiate(config.budget)
        with ExitStack() as stack:  # closes each that was made, whatever happens in the others
            renderer = instantiate(config.renderer)
            stack.callback(renderer.close)
            costs = run_costs(config, budget=budget, renderer=renderer)
            settings = run_settings(config, scene_hash=renderer.scene_hash, costs=costs)
            folder = learn.RunFolder(Path(config.run.folder), settings=settings)
            stack.callback(folder.close)
            tracker = instantiate(config.tracker)
            stack.push(partial(_finish, tracker))
            if folder.result is not None:
                log.info("%s is finished already; delete the folder to run it again", folder.path)
                return folder.result
            if "path_tracing" in config:
                from ngi.denoise.run import run_path_tracing

                return run_path_tracing(config, renderer=renderer, folder=folder, tracker=tracker)
            return _train(config, budget, renderer, folder, tracker, interruption, stack)


def _finish(tracker: learn.Tracker, failure: type[BaseException] | None, *_: object) -> None:
    """As the end of a `with` block."""
    tracker.finish(failed=failure is not None)


def _train(
    config: DictConfig,
    budget: learn.Budget,
    renderer: Renderer,
    folder: learn.RunFolder,
    tracker: learn.Tracker,
    interruption: learn.Interruption,
    closing: ExitStack,
) -> dict[str, Any]:
    """closing: closes what is opened here"""
    from ngi import learn
    from ngi.learn.code_versions import record_code_version

    schedule = instantiate(config.schedule)
    schedule.check(budget)
    clock = learn.PhaseClock(energy=EnergyMeter(energy_counters()))
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(config, samples=samples, clock=clock, patches=folder.patches)
    module = build_module(config, samples=samples, target=stream.sampler.target, clock=clock)
    costs = folder.settings["costs"]
    run_clock = (
        clock if costs is None else learn.ModelClock(costs=costs, counters=lambda: stream.counters)
    )
    recorder = learn.Recorder(
        evaluator=instantiate(config.evaluation.evaluator)(
            renderer=renderer, test_inputs=samples.test_inputs
        ),
        target_map=_target_map(config, samples, signals=interruption.checked(module.signals)),
        predict=interruption.checked(module.predict),
        folder=folder,
        stream=stream,
        clock=clock,
        run_clock=run_clock,
        tracker=tracker,
        label={**plain(config.label), "seed": config.seed},
        backend=renderer.description,
    )
    callbacks = learn.callbacks(
        stream=stream,
        clock=clock,
        run_clock=run_clock,
        folder=folder,
        tracker=tracker,
        budget=budget,
        schedule=schedule,
        recorder=recorder,
        evaluations=config.evaluation.count,
        checkpoint_seconds=config.run.checkpoint_seconds,
        checkpoint_steps=config.run.checkpoint_steps,
        interruption=interruption,
    )
    module.rehearse(samples.blank(2))
    if config.viewer:
        view = _live_view(config, renderer, samples, module, stream, folder, clock)
        closing.callback(view.close)
        callbacks.append(view)
    trainer = _trainer(config, budget, folder, callbacks)
    checkpoint = learn.prepare_resume(folder)
    folder.begin(scene_place=scene_place(config))
    commit, dirty = code_commit()
    record_code_version(folder.path, commit=commit, dirty=dirty, after_step=folder.steps.last_step)
    recorder.prepare()
    renderer.warm_up()
    with interruption.deferred():
        trainer.fit(
            module,
            learn.ExplorationDataModule(stream=stream),
            ckpt_path=checkpoint,
            weights_only=True,
        )
    module.to(trainer.strategy.root_device)  # Lightning has taken it back to the CPU
    for optimizer in trainer.optimizers:
        optimizer.load_state_dict(optimizer.state_dict())  # moves its state to the weights
    return recorder.finish()


def _trainer(
    config: DictConfig,
    budget: learn.Budget,
    folder: learn.RunFolder,
    callbacks: list[Callback],
) -> Trainer:
    from ngi import learn

    checkpoints = learn.AtomicCheckpointIO(
        identity=folder.identity, previous=folder.previous_checkpoint
    )
    trainer: Trainer = instantiate(config.trainer)(
        default_root_dir=folder.path,
        max_steps=budget.maximum_steps,
        callbacks=callbacks,
        plugins=[checkpoints],
    )
    return trainer


def _target_map(
    config: DictConfig, samples: learn.Samples, *, signals: Callable[..., Any]
) -> learn.TargetMap | None:
    """What is measured of the target density at every evaluation, where that is asked for."""
    if config.evaluation.target_map is None:
        return None
    target_map: learn.TargetMap = instantiate(config.evaluation.target_map)(
        samples=samples,
        resolution=instantiate(config.resolution).resolution(0),
        signals=signals,
    )
    return target_map


def _live_view(
    config: DictConfig,
    renderer: Renderer,
    samples: learn.Samples,
    module: learn.IlluminationModule,
    stream: learn.TrainingStream,
    folder: learn.RunFolder,
    clock: learn.PhaseClock,
) -> LiveView:
    """The run in the browser; RuntimeError where the libraries for it are not installed."""
    try:
        from ngi.view.live import live_view
    except ModuleNotFoundError as error:
        raise RuntimeError(f"viewer=true needs {error.name}: pip install -e .[viewer]") from error
    return live_view(
        renderer=renderer,
        samples=samples,
        module=module,
        stream=stream,
        folder=folder,
        clock=clock,
        scene_name=config.scene.name,
        description=instantiate(config.scene.reader) if "scene" in config.renderer else None,
        protocol=instantiate(config.evaluation.evaluator.protocol),
        port=config.run.viewer_port,
    )


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> None:
    try:
        result = train(config)
    except MESSAGES as error:
        # Hydra reports only the first failed job of a sweep: each says for itself what was wrong,
        # once, in its own log too; the traceback is for those who ask for it.
        log.error("%s", error)
        log.debug("traceback", exc_info=True)
        what = "see above" if _shares_the_terminal() else error
        raise CompactHydraException(f"{config.run.folder} failed: {what}") from error
    hard = result["metrics"]["hard"]
    log.info(
        "%s: %s",
        config.run.folder,
        ", ".join(f"{name} {value['mean']:.4g}" for name, value in hard.items() if value),
    )


def _shares_the_terminal() -> bool:
    """Whether what the job logs is shown where Hydra reports its failure.

    Jobs of Submitit, on this machine or in a cluster, log into files of their own only.
    """
    return "submitit" not in HydraConfig.get().launcher._target_


def main() -> None:
    """Entry point of `ngi train` and `python -m ngi.train`."""
    register()
    _main()


if __name__ == "__main__":
    main()
