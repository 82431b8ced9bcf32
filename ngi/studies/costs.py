"""Measures what the steps of runs cost, for `budget.clock=model`: `ngi costs --help`."""

from __future__ import annotations

import json
import logging
import os
import sys
from contextlib import closing
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import hydra
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf, open_dict
from tabulate import tabulate

from ngi.config.build import build_module, build_samples, build_stream, run_components, without_seed
from ngi.config.command_words import completed, with_overrides
from ngi.config.configuration import register
from ngi.config.hydra_program import job_of, run_program
from ngi.config.values import check_values
from ngi.files.resources import CACHE_VARIABLE, cache_folder, root
from ngi.machine.memory import keep_freed_memory
from ngi.machine.size import usable_cores

if TYPE_CHECKING:
    from ngi.learn import Component, CostFile
    from ngi.render import Renderer

log = logging.getLogger(__name__)

SECONDS = 6.0
"""Of timings per component; more where that is not enough for a few rounds."""
BUSY = 0.5
"""Load average, over the last minute, from which on others disturb the measurement."""

_looked_at: set[str] = set()
"""Runs that differ from an earlier one of this sweep by their seeds need no second look."""


def measure(config: DictConfig) -> None:
    """Adds the components of this run that the cost file lacks, and prints them.

    Patches are rendered in this process, whatever `renderer.workers` says. Training is timed on
    patches of closed formulas, with buffers and variables as the scene's. Raises ValueError for a
    cost file that is damaged and for what `ngi.train` refuses too.
    """
    check_values(config)
    from ngi import learn

    settings = without_seed(config)
    if (name := json.dumps(settings, sort_keys=True)) in _looked_at:
        return
    _looked_at.add(name)
    keep_freed_memory()
    file = learn.CostFile(Path(config.budget.costs))
    with closing(instantiate(in_this_process(config.renderer))) as renderer:
        wanted = run_components(config, renderer=renderer)
        missing = file.missing(wanted)
        if missing:
            _measure(config, missing, renderer=renderer, file=file)
    print(_table(wanted, new=missing, file=file), flush=True)


def _measure(
    config: DictConfig, missing: list[Component], *, renderer: Renderer, file: CostFile
) -> None:
    from ngi.machine.provenance import provenance
    from ngi.studies.step_costs import rendering_seconds

    _warn_if_busy()
    for component in missing:
        log.info("measuring %s", component.key)
    measured = {}
    if names := {component.name for component in missing} - {"rendering"}:
        measured = _step_seconds(config, renderer=renderer, scored="scoring" in names)
    if any(component.name == "rendering" for component in missing):
        renderer.warm_up()
        measured["rendering"] = rendering_seconds(
            build_samples(config, renderer=renderer),
            count=config.sampler.chains,
            patches_per_vector=instantiate(config.sampler).patches_per_vector,
            seconds=SECONDS,
        )
    found = provenance(backend=renderer.description)
    measured_by = {key: found[key] for key in ("commit", "dirty", "machine")}
    for component in missing:
        file.add(component, measured[component.name], measured_by=measured_by)


def _step_seconds(
    config: DictConfig, *, renderer: Renderer, scored: bool
) -> dict[str, dict[str, list[float]]]:
    """Trains for a few seconds, with steps of all kinds in turn."""
    from ngi import learn
    from ngi.render import AnalyticRenderer
    from ngi.studies.step_costs import StepTimer, step_seconds

    stand_in = AnalyticRenderer(
        dimensions=renderer.dimensions,
        patch_size=renderer.patch_size,
        samples_per_pixel=2,
        halves=renderer.halves,
        layout=renderer.layout,
    )
    # The network's inputs, which are the scene's; the closed formulas care for neither.
    stand_in.moving_points = renderer.moving_points
    if config.data.get("camera") is False:
        stand_in.camera_part = renderer.camera_part
    config = config.copy()
    with open_dict(config):
        here = "ngi.studies.step_costs"
        config.reuse.policy = {"_target_": f"{here}.InTurn"}
        if "acceptance" in config.sampler:
            config.sampler.acceptance = {"_target_": f"{here}.ScoredInTurn", "scored": scored}
    with TemporaryDirectory() as folder:
        clock = learn.PhaseClock()
        run = learn.RunFolder(Path(folder), settings={})
        samples = build_samples(config, renderer=stand_in)
        stream = build_stream(
            config, renderer=stand_in, samples=samples, clock=clock, patches=run.patches
        )
        module = build_module(config, samples=samples, stream=stream, folder=Path(folder))
        timer = StepTimer(clock=clock, scored=scored, seconds=SECONDS)
        steps = learn.StepLog(stream=stream, run_clock=clock, folder=run, tracker=learn.Local())
        trainer = instantiate(config.trainer)(
            default_root_dir=folder, max_steps=-1, callbacks=[steps, timer]
        )
        with closing(run):
            trainer.fit(module, learn.ExplorationDataModule(stream=stream))
    return step_seconds(timer.rounds())


@cache
def _warn_if_busy() -> None:
    """Once per process, before its own measuring makes the machine busy."""
    load, *_ = os.getloadavg()
    if load > BUSY:
        log.warning(
            "this machine is busy (load average %.1f on %d cores), which makes measured costs too "
            "high; stop other programs, delete these costs from the file and measure again",
            load,
            usable_cores(),
        )


def in_this_process(renderer: DictConfig) -> DictConfig:
    serial = {"workers": 0, "cluster": None} if "workers" in renderer else {}
    return OmegaConf.merge(renderer, serial)  # type: ignore[return-value]


def _table(wanted: list[Component], *, new: list[Component], file: CostFile) -> str:
    rows: list[list[Any]] = []
    costs = file.costs(wanted)
    for component in wanted:
        for phase, seconds in costs[component.name].items():
            rows.append([component.key, phase, 1e3 * seconds, "new" if component in new else ""])
    table: str = tabulate(rows, headers=["component", "phase", "ms per step", ""], floatfmt=".2f")
    return table


# Its log is kept beside the cost file; the runs' own folders are left alone.
@hydra.main(version_base="1.3", config_path=str(root() / "conf"), config_name="train")
def _main(config: DictConfig) -> None:
    with job_of(config.label.scene):
        measure(config)


def main() -> None:
    """Entry point of `ngi costs`."""
    register()
    folder = cache_folder() / "costs"
    places = (f"hydra.{mode}.dir={folder}" for mode in ("run", "sweep"))
    sys.argv[1:] = with_overrides(completed(sys.argv[1:]), "hydra/help=costs", *places)
    run_program(_main, folder_option=CACHE_VARIABLE)


if __name__ == "__main__":
    main()
