"""Builds what training and the measurement of its costs share from a Hydra configuration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

if TYPE_CHECKING:  # PyTorch and Lightning take seconds that --help need not wait for
    from ngi.explore import Target
    from ngi.learn import (
        Budget,
        Component,
        Costs,
        IlluminationModule,
        PhaseClock,
        Samples,
        TrainingStream,
    )
    from ngi.render import Renderer


def build_samples(config: DictConfig, *, renderer: Renderer) -> Samples:
    """What the run's training samples are."""
    samples: Samples = instantiate(config.data)(renderer=renderer)
    return samples


def build_stream(
    config: DictConfig, *, samples: Samples, clock: PhaseClock, patches: Path
) -> TrainingStream:
    """The stream of training batches. patches: folder that its store is archived in."""
    from ngi import learn

    return learn.TrainingStream(
        samples=samples,
        sampler=instantiate(config.sampler),
        store=instantiate(config.reuse.store)(layout=samples.layout),
        archive=learn.PatchArchive(patches),
        policy=instantiate(config.reuse.policy),
        schedule=instantiate(config.resolution),
        clock=clock,
        seed=config.seed,
        when_late=config.reuse.when_late,
    )


def build_module(
    config: DictConfig, *, samples: Samples, target: Target, clock: PhaseClock
) -> IlluminationModule:
    """Network, loss and optimiser, for these samples."""
    from ngi import learn

    return learn.IlluminationModule(
        network=learn.seeded(instantiate(config.model), seed=config.seed)(
            layout=samples.layout, scene_dimensions=samples.network_dimensions
        ),
        loss=instantiate(config.loss),
        optimizer=instantiate(config.optimizer),
        target=target,
        clock=clock,
        example=samples.example,
        averaging=instantiate(config.averaging),
    )


def run_components(config: DictConfig, *, renderer: Renderer) -> list[Component]:
    """What the steps of this run spend time on, see `ngi.learn.costs`.

    Nothing, where path tracing takes the network's place.
    """
    from ngi import learn

    if "path_tracing" in config:
        return []
    scored = instantiate(config.sampler).needs_current
    return learn.components(plain(config), renderer=renderer, scored=scored)


def run_costs(config: DictConfig, *, budget: Budget, renderer: Renderer) -> Costs | None:
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


def plain(config: DictConfig) -> dict[str, Any]:
    """The resolved configuration as plain JSON data."""
    container = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    assert isinstance(container, dict)
    return {str(key): value for key, value in container.items()}
