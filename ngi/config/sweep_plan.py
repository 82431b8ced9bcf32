"""What the runs of a sweep are, how much of each is done, and how long the rest will take."""

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.config_loader import ConfigLoader
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException
from tabulate import tabulate
from tqdm import tqdm

from ngi.clock.costs import REMEDY
from ngi.clock.counters import Counters
from ngi.config.build import plain, run_components, without_seed
from ngi.config.configuration import run_settings, scene_place
from ngi.config.hydra_program import MESSAGES, in_plain_words
from ngi.config.values import check_values
from ngi.files.code_versions import code_version, made_with, same_program
from ngi.files.row_log import RowLog
from ngi.files.run_folder import (
    CHECKPOINTS,
    RESULT,
    SETTINGS,
    STEPS,
    differences,
    has_something,
    kept_settings,
    longer,
)
from ngi.learn import Budget, CostFile, ModelClock


@dataclass(frozen=True)
class Planned:
    """A run of a sweep.

    state: 'finished', 'new', 'interrupted', 'longer' (finished with a smaller budget), 'again'
        (`run.on_code_change=restart`), or else why it cannot start
    done: part of its budget that is used up, 0 to 1
    left: seconds of training that are left, about: what comes after the last checkpoint is done
        again; None where nobody knows, and 0 where a run trains nothing
    settings: what decides the result, but for the budget
    choices: words that not all runs of the sweep have in common; the folder's name may be cut
    """

    folder: Path
    state: str
    done: float
    left: float | None
    settings: str = ""
    choices: str = ""

    @property
    def runs(self) -> bool:
        """Whether there is something left to do that can be done."""
        return self.state in ("new", "interrupted", "longer", "again")


def planned_runs(config: DictConfig, loader: ConfigLoader) -> list[Planned]:
    """One per job of a sweep; none where its sweeper chooses the jobs as it goes.

    config: of the sweep, with Hydra's own part
    """
    sweeper = config.hydra.sweeper
    if sweeper._target_ != f"{BasicSweeper.__module__}.{BasicSweeper.__name__}":
        return []
    words = [f"{key}={value}" for key, value in (sweeper.params or {}).items()]
    given: Any = OmegaConf.to_container(config.hydra.overrides.task, resolve=False)
    words += given
    overrides = OverridesParser.create(config_loader=loader).parse_overrides(words)
    (jobs,) = BasicSweeper.split_arguments(overrides, max_batch_size=None)
    costs: dict[str, float | None] = {}
    with tqdm(jobs, desc="plan", unit="run", leave=False, disable=None) as shown:
        runs = _apart([planned_run(loader.load_sweep_config(config, job), costs) for job in shown])
    common = set.intersection(*map(set, jobs))
    chosen = [" ".join(word for word in job if word not in common) for job in jobs]
    return [replace(run, choices=words) for run, words in zip(runs, chosen, strict=True)]


def _apart(runs: Sequence[Planned]) -> list[Planned]:
    """The same runs; of different ones in one folder only the first can start."""
    first: dict[Path, str] = {}
    found = []
    for run in runs:
        if run.runs and first.setdefault(run.folder, run.settings) != run.settings:
            state = "cannot start: an earlier run of this sweep uses its folder; see run.folder"
            run = replace(run, state=state, done=0.0, left=None)
        found.append(run)
    return found


def planned_run(config: DictConfig, costs: dict[str, float | None]) -> Planned:
    """config: of one job, with Hydra's own part; costs: seconds per step, kept between calls"""
    HydraConfig.instance().set_config(config)
    config = config.copy()  # Hydra's own part goes on resolving in the one that it is part of
    with open_dict(config):
        del config["hydra"]
    folder = Path(config.run.folder).resolve()
    try:
        check_values(config)
        if "scene" in config.renderer:
            _read(json.dumps(plain(config.scene.reader)))
        budget: Budget = instantiate(config.budget)
        state = _state(config, folder)
        if state != "finished" and "path_tracing" not in config:
            _check_measured(budget)
        done = _done(folder, budget) if state in ("interrupted", "longer") else 0.0
        left = 0.0 if "path_tracing" in config else _left(config, budget, done, costs)
    except (*MESSAGES, HydraException, OmegaConfBaseException) as error:
        why = in_plain_words(error).splitlines()[0]
        return Planned(folder, f"cannot start: {why}", 0.0, None)
    if state == "finished":
        done, left = 1.0, 0.0
    # Two scenes of one name are told apart by where they lie, before they are read.
    settings = {**run_settings(config, scene_hash="", costs=None), "budget": None}
    settings["scene"] |= {"place": scene_place(config)}
    return Planned(folder, state, done, left, settings=json.dumps(settings))


def _check_measured(budget: Budget) -> None:
    """ValueError where the model clock has nothing at all to count with."""
    if budget.clock == "model" and not Path(str(budget.costs)).exists():
        raise ValueError(f"budget.costs: {budget.costs} does not exist; {REMEDY}")


@cache
def _read(reader: str) -> None:
    """Makes a reader, given as JSON, to see whether the scene can be read."""
    words = OmegaConf.create({"scene": {"reader": json.loads(reader)}})
    instantiate(words, _convert_="all")  # or OmegaConf takes the scene itself for a configuration


def _state(config: DictConfig, folder: Path) -> str:
    """As `RunFolder` will find it, but for scenes and costs that have changed meanwhile."""
    if not has_something(folder):
        return "new"
    there = kept_settings(folder)
    is_longer = there is not None and _is_longer(config, there, folder)
    if is_longer and not any((folder / name).exists() for name in CHECKPOINTS):
        raise ValueError("it cannot be trained longer: there is no checkpoint in its folder")
    made = made_with(folder, last_step=RowLog(folder / STEPS).last_step)
    if made is not None and not same_program(made, code_version(there)):
        if config.run.on_code_change == "restart":
            return "again"
        if config.run.on_code_change == "refuse":
            raise ValueError("the program has changed since, and run.on_code_change=refuse")
    if not (folder / RESULT).exists():
        return "interrupted"
    return "longer" if is_longer else "finished"


def _is_longer(config: DictConfig, there: Any, folder: Path) -> bool:
    """Whether its budget is larger than in these settings; ValueError for those of another run."""
    try:
        known = {"scene_hash": there["scene"]["hash"], "costs": there["costs"]}
    except (KeyError, TypeError):
        raise ValueError(f"{folder / SETTINGS} is not of a run; delete the folder") from None
    ours = run_settings(config, **known)
    is_longer = longer(ours, than=there)
    if ours != there and not is_longer:
        what = "; ".join(differences(there, ours)[:3])
        raise ValueError(
            f"its folder holds another run ({what}); choose one with run.folder=…, or move it away"
        )
    return is_longer


def _done(folder: Path, budget: Budget) -> float:
    last = RowLog(folder / STEPS).last_row
    if last is None:
        return 0.0
    return min(
        1.0, budget.fraction(steps=int(last["step"]), run_seconds=float(last["run_seconds"]))
    )


def _left(
    config: DictConfig, budget: Budget, done: float, costs: dict[str, float | None]
) -> float | None:
    """By the seconds of the budget, or by its steps and what they were measured to cost."""
    limits = [] if budget.seconds is None else [budget.seconds]
    if budget.steps is not None:
        key = json.dumps({**without_seed(config), "budget": 0})
        if key not in costs:
            costs[key] = _seconds_per_step(config)
        if (seconds := costs[key]) is not None:
            limits.append(budget.steps * seconds)
    return (1 - done) * min(limits) if limits else None


def _seconds_per_step(config: DictConfig) -> float | None:
    """Of a step with all that a step can have; None where that was never measured."""
    if config.budget.costs is None:
        return None
    file = CostFile(Path(config.budget.costs))
    if not file.path.exists():
        return None
    renderer = instantiate(config.renderer)
    try:
        costs = file.costs(run_components(config, renderer=renderer))
    except ValueError:
        return None
    finally:
        renderer.close()
    whole = Counters(iteration=1, generated_batches=1, scored_batches=1)
    return ModelClock(costs=costs, counters=lambda: whole).run_seconds


def table(runs: Sequence[Planned]) -> str:
    """A row per run, and what it comes to."""
    rows = [
        [shown(run.folder), run.state, f"{run.done:.0%}", duration(run.left), run.choices]
        for run in runs
    ]
    headers = ["run", "state", "done", "training left", "what this sweep sets"]
    states = Counter(run.state.split(":")[0] for run in runs)
    total = [f"{count} {state}" for state, count in states.items()]
    to_do = [run for run in runs if run.runs]
    known = [run.left for run in to_do if run.left is not None]
    summary = f"{counted(runs)}: {', '.join(total)}"
    if known:
        summary += f"; about {duration(sum(known))} of training left"
    if len(known) < len(to_do):
        what = "they take" if not known else f"{len(to_do) - len(known)} of them take"
        summary += f"; how long {what} is unknown, `ngi costs` with the same arguments measures it"
    return f"{tabulate(rows, headers)}\n\n{summary}; evaluations and references come on top"


def counted(runs: Sequence[Any]) -> str:
    return "1 run" if len(runs) == 1 else f"{len(runs)} runs"


def duration(seconds: float | None) -> str:
    """'1:02:03', '2:03', or '?'."""
    if seconds is None:
        return "?"
    minutes, rest = divmod(math.ceil(seconds - 1e-6), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def shown(folder: Path) -> str:
    """Relative to here, if it is below."""
    here = Path.cwd()
    return str(folder.relative_to(here) if folder.is_relative_to(here) else folder)
