"""Builds the parts of a run, and what measuring its costs shares, from a Hydra configuration."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from ngi.machine.energy import EnergyMeter, energy_counters
from ngi.machine.precision import trains_on_gpu

if TYPE_CHECKING:  # PyTorch and Lightning take seconds that --help need not wait for
    from torch import nn

    from ngi import learn
    from ngi.render import Renderer
    from ngi.reuse import ReusePolicy


def build_samples(config: DictConfig, *, renderer: Renderer) -> learn.Samples:
    """What the run's training samples are."""
    samples: learn.Samples = instantiate(config.data)(renderer=renderer)
    return samples


def build_stream(
    config: DictConfig,
    *,
    renderer: Renderer,
    samples: learn.Samples,
    clock: learn.PhaseClock,
    patches: Path,
) -> learn.TrainingStream:
    """The stream of training batches. patches: folder that its store is archived in."""
    from ngi.learn import TrainingStream
    from ngi.reuse import PatchArchive, Reuse

    return TrainingStream(
        samples=samples,
        sampler=instantiate(config.sampler),
        reuse=Reuse(
            store=instantiate(config.reuse.store)(
                layout=samples.layout, device=training_device(config)
            ),
            archive=PatchArchive(patches),
            policy=reuse_policy(config, samples_per_pixel=renderer.samples_per_pixel),
            when_late=config.reuse.when_late,
        ),
        schedule=instantiate(config.resolution),
        clock=clock,
        seed=config.seed,
    )


def reuse_policy(config: DictConfig, *, samples_per_pixel: int) -> ReusePolicy:
    """The reuse policy; one that is configured in part is told how clean patches are."""
    policy: ReusePolicy | partial[ReusePolicy] = instantiate(config.reuse.policy)
    return policy(samples_per_pixel=samples_per_pixel) if isinstance(policy, partial) else policy


def build_network(config: DictConfig, *, samples: learn.Samples) -> nn.Module:
    """The network for these samples, its weights as they are before the first step."""
    from ngi import learn

    make = learn.seeded(instantiate(config.model), seed=config.seed)
    try:
        return learn.network_of(samples, make)
    except TypeError as error:
        raise ValueError(
            f"model: {error}; a network's arguments are the keys of model (budgets set "
            "hidden_features and hidden_layers) and, optionally, layout, scene_dimensions and "
            "moving"
        ) from error


def build_module(
    config: DictConfig, *, samples: learn.Samples, stream: learn.TrainingStream, folder: Path
) -> learn.IlluminationModule:
    """Network, loss and optimiser, for these samples. folder: for the guard's report."""
    import torch

    from ngi import learn

    module = learn.IlluminationModule(
        network=build_network(config, samples=samples),
        loss=instantiate(config.loss),
        optimizer=instantiate(config.optimizer),
        example=samples.example,
        render=samples.render,
        stream=stream,
        guard=learn.StepGuard(stream=stream, folder=folder),
        averaging=instantiate(config.averaging),
    )
    if stream.sampler.needs_description:
        module.averaged_network()  # what these two raise is said now, not at the first batch
        state = torch.zeros(1, samples.dimensions + 2)
        samples.glimpses(state, resolution=samples.patch_size)
        stream.description = learn.Description(samples=samples, answers=module.answers)
    return module


def build_run(
    config: DictConfig,
    *,
    folder: learn.RunFolder,
    tracker: learn.Tracker,
    interruption: learn.Interruption,
    budget: learn.Budget,
    renderer: Renderer,
) -> learn.Run:
    """All that takes part in a run. ValueError where its parts do not fit each other."""
    from ngi import learn

    schedule = instantiate(config.schedule)
    schedule.check(budget)
    clock = learn.PhaseClock(energy=EnergyMeter(energy_counters()))
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(
        config, renderer=renderer, samples=samples, clock=clock, patches=folder.patches
    )
    run_clock: learn.RunClock = clock
    if (costs := folder.settings["costs"]) is not None:
        run_clock = learn.ModelClock(costs=costs, counters=lambda: stream.counters)
    if stored_alone := stream.policy.stored_alone:
        stream.progress = learn.Progress(
            budget=budget,
            clock=run_clock,
            counters=lambda: stream.counters,
            stored_alone=stored_alone,
        )
    return learn.Run(
        folder=folder,
        tracker=tracker,
        interruption=interruption,
        budget=budget,
        schedule=schedule,
        renderer=renderer,
        samples=samples,
        stream=stream,
        module=build_module(config, samples=samples, stream=stream, folder=folder.path),
        run_clock=run_clock,
    )


def build_recorder(config: DictConfig, run: learn.Run) -> learn.Recorder:
    """What evaluates the run and writes down what is found."""
    from ngi import learn

    target_map = None
    if config.evaluation.target_map is not None:
        target_map = instantiate(config.evaluation.target_map)(
            samples=run.samples,
            resolution=instantiate(config.resolution).resolution(0),
            signals=run.interruption.checked(run.module.signals),
        )
    evaluator = instantiate(config.evaluation.evaluator)(
        renderer=run.renderer, test_inputs=run.samples.test_inputs
    )
    label = {**plain(config.label), "seed": config.seed}
    return learn.Recorder(run, evaluator=evaluator, target_map=target_map, label=label)


def run_components(config: DictConfig, *, renderer: Renderer) -> list[learn.Component]:
    """What the steps of this run spend time on, see `ngi.clock.costs`.

    Nothing, where path tracing takes the network's place.
    """
    from ngi import learn

    if "path_tracing" in config:
        return []
    sampler = instantiate(config.sampler)
    if sampler.needs_description:
        raise ValueError(
            "sampler: it inspects patches before they are traced, and budget.clock=model cannot "
            "count that; choose budget.clock=wall, or limit the run by budget.steps"
        )
    return learn.components(
        plain(config),
        renderer=renderer,
        scored=sampler.needs_current,
        patches_per_vector=sampler.patches_per_vector,
    )


def run_costs(
    config: DictConfig, *, budget: learn.Budget, renderer: Renderer
) -> learn.Costs | None:
    """What the model clock counts with; None for the wall clock.

    Raises ValueError for costs that nobody has measured yet, and where batches depend on speed.
    """
    from ngi import learn

    if budget.costs is None or budget.clock == "wall":
        return None
    if config.reuse.when_late != "wait":
        raise ValueError(
            f"reuse.when_late: '{config.reuse.when_late}' lets the speed of this machine decide "
            "which batches are new; with budget.clock=model choose 'wait'"
        )
    return learn.CostFile(Path(budget.costs)).costs(run_components(config, renderer=renderer))


def training_device(config: DictConfig) -> str:
    """Where Lightning's trainer trains."""
    return "cuda" if trains_on_gpu(config.trainer.accelerator) else "cpu"


def without_seed(config: DictConfig) -> dict[str, Any]:
    """`plain`, the same for all seeds and labels of a run, wherever it lies."""
    config = config.copy()
    config.seed = 0  # which a Sobol sequence has, too
    return {**plain(config), "run": None, "label": None}


def plain(config: DictConfig) -> dict[str, Any]:
    """The resolved configuration as plain JSON data."""
    container = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    assert isinstance(container, dict)
    return {str(key): value for key, value in container.items()}
