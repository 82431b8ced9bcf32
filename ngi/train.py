"""Trains one run from a Hydra configuration: `ngi train --help`."""

from __future__ import annotations

import logging
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hydra
from hydra.utils import instantiate
from omegaconf import DictConfig

from ngi.config.build import build_recorder, build_run, plain, run_costs, training_device
from ngi.config.command_words import completed, with_overrides
from ngi.config.configuration import register, run_settings, scene_record
from ngi.config.hydra_program import fail, job_of, run_program
from ngi.config.outline import only_bootstrap, outline
from ngi.config.values import check_values
from ngi.files.extras import install_command
from ngi.files.resources import root
from ngi.machine.memory import keep_freed_memory
from ngi.machine.repeatable import make_repeatable

if TYPE_CHECKING:
    from ngi import learn
    from ngi.learn.lightning_api import Callback, Trainer
    from ngi.view.live import LiveView

log = logging.getLogger(__name__)


def train(config: DictConfig) -> dict[str, Any]:
    """Runs, or resumes, the run that `config` describes and returns its result.

    Where it says `path_tracing`, that takes the network's place and nothing is trained. A finished
    run is not run again. Raises ValueError for a configuration, scene, folder or checkpoint that
    does not fit, before any long work; `Interrupted` after a signal.
    """
    from ngi import learn  # PyTorch and Lightning take seconds that --help need not wait for
    from ngi.learn.code_change import heed_code_change

    keep_freed_memory()
    make_repeatable()
    check_values(config)
    with learn.Interruption(of=config.run.folder) as interruption:
        budget = instantiate(config.budget)
        with ExitStack() as stack:  # closes each that was made, whatever happens in the others
            renderer = instantiate(config.renderer)
            stack.callback(renderer.close)
            costs = run_costs(config, budget=budget, renderer=renderer)
            settings = run_settings(config, scene_hash=renderer.scene_hash, costs=costs)
            folder = learn.RunFolder(
                Path(config.run.folder),
                settings=settings,
                linear_megabytes=config.run.linear_megabytes,
            )
            stack.callback(folder.close)
            tracker = instantiate(config.tracker)
            stack.push(partial(_finish, tracker))
            heed_code_change(folder, on_change=config.run.on_code_change)
            if (result := folder.result) is not None:
                log.info("%s is already finished; to run it again, delete the folder", folder.path)
                tracker.finished(folder=folder.path, settings=settings, label=result["label"])
                return result
            if "path_tracing" in config:
                from ngi.methods.path_tracing.run import run_path_tracing

                return run_path_tracing(config, renderer=renderer, folder=folder, tracker=tracker)
            log.info("%s", outline(plain(config), device=training_device(config)))
            run = build_run(
                config,
                folder=folder,
                tracker=tracker,
                interruption=interruption,
                budget=budget,
                renderer=renderer,
            )
            return _train(config, run, closing=stack)


def _finish(
    tracker: learn.Tracker, _type: object, failure: BaseException | None, _traceback: object
) -> None:
    """As the end of a `with` block."""
    tracker.finish(failure)


def _train(config: DictConfig, run: learn.Run, *, closing: ExitStack) -> dict[str, Any]:
    """closing: closes what is opened here"""
    from ngi import learn

    recorder = build_recorder(config, run)
    callbacks = learn.callbacks(
        run,
        recorder=recorder,
        evaluations=config.evaluation.count,
        checkpoint_seconds=config.run.checkpoint_seconds,
        checkpoint_steps=config.run.checkpoint_steps,
    )
    run.module.rehearse(run.samples.blank(2), targets=recorder.targets)
    if config.viewer:
        view = _live_view(config, run)
        closing.callback(view.close)
        callbacks.append(view)
    trainer = _trainer(config, run, callbacks)
    checkpoint = learn.prepare_resume(run.folder)
    _begin(config, run.folder)
    recorder.prepare()
    run.renderer.warm_up()
    with run.interruption.deferred():
        trainer.fit(
            run.module,
            learn.ExplorationDataModule(stream=run.stream),
            ckpt_path=checkpoint,
            weights_only=True,
        )
    counters = run.stream.counters
    if problem := only_bootstrap(
        plain(config), steps=counters.iteration, generated_batches=counters.generated_batches
    ):
        log.warning("%s", problem)
    run.stream.catch_up()  # a frame's time is measured, without patches being traced beside it
    run.module.to(trainer.strategy.root_device)  # Lightning has taken it back to the CPU
    for optimizer in trainer.optimizers:
        optimizer.load_state_dict(optimizer.state_dict())  # moves its state to the weights
    return recorder.finish()


def _trainer(config: DictConfig, run: learn.Run, callbacks: list[Callback]) -> Trainer:
    from ngi import learn
    from ngi.learn.lightning_api import LightningEnvironment

    checkpoints = learn.AtomicCheckpointIO(
        identity=run.folder.identity, previous=run.folder.previous_checkpoint
    )
    try:
        trainer: Trainer = instantiate(config.trainer)(
            default_root_dir=run.folder.path,
            max_steps=run.budget.maximum_steps,
            callbacks=callbacks,
            plugins=[checkpoints, LightningEnvironment()],  # Slurm's would save within a step
        )
    except ValueError as error:  # Lightning does not say where it stands
        raise ValueError(f"trainer: {error}") from error
    return trainer


def _begin(config: DictConfig, folder: learn.RunFolder) -> None:
    """Writes down where the scene lies, and which code the steps from here on are made with."""
    from ngi.files.code_versions import record_code_version

    folder.begin(scene=scene_record(config))
    record_code_version(folder.path, after_step=folder.steps.last_step, settings=folder.settings)


def _live_view(config: DictConfig, run: learn.Run) -> LiveView:
    """The run in the browser; RuntimeError where the libraries for it are not installed."""
    try:
        from ngi.view.live import live_view
    except ModuleNotFoundError as error:
        raise RuntimeError(
            f"viewer=true needs {error.name}: {install_command('viewer')}"
        ) from error
    return live_view(
        run,
        scene_name=config.scene.name,
        description=instantiate(config.scene.reader) if "scene" in config.renderer else None,
        protocol=instantiate(config.evaluation.evaluator.protocol),
        port=config.run.viewer_port,
    )


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> float:
    """The mean MAPE on hard frames, which a sweeper that optimises minimises."""
    from ngi.render.pilot_advice import pilot_advice

    with job_of(config.run.folder):
        result = train(config)
    hard = result["metrics"]["hard"]
    log.info(
        "%s: %s",
        config.run.folder,
        ", ".join(f"{name} {value['mean']:.4g}" for name, value in hard.items() if value),
    )
    if (share := result.get("new_worst_share")) is not None:
        log.info("%s", pilot_advice(share))
    return float(hard["mape"]["mean"])


@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _train_nothing(config: DictConfig) -> None:
    """The job of a dry run, which ends before there is one."""
    fail(
        RuntimeError(f"{DRY_RUN}: nothing is trained, and no plan was made"), job=config.run.folder
    )


DRY_RUN = "--dry-run"
"""Word of the command line: shows what would run, and runs nothing."""

SWEEP = "+hydra.callbacks.sweep={{_target_:ngi.config.sweep.Sweep,dry_run:{}}}"


def main() -> None:
    """Entry point of `ngi train` and `python -m ngi.train`."""
    register()
    dry_run = DRY_RUN in sys.argv
    words = [word for word in sys.argv[1:] if word != DRY_RUN]
    sys.argv[1:] = with_overrides(completed(words), SWEEP.format(str(dry_run).lower()))
    run_program(_train_nothing if dry_run else _main)


if __name__ == "__main__":
    main()
