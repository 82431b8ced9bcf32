"""What Hydra has to know of this program, and which part of a configuration a run is told by."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import hydra
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

import ngi
from ngi.config.build import plain
from ngi.files.resources import cache_folder, root
from ngi.files.run_names import run_group, run_name, said_overrides
from ngi.machine.precision import fast_precision
from ngi.machine.size import bootstrap_batches, network_depth, network_width, warmup_steps
from ngi.scene import scenes


def choice(group: str, *, _root_: DictConfig) -> Any:
    """Which option of a group is chosen, in a configuration with Hydra's own part or without."""
    hydra_part = _root_.hydra if "hydra" in _root_ else HydraConfig.get()
    return hydra_part.runtime.choices[group]


if TYPE_CHECKING:
    from ngi.learn import Costs

NOT_IDENTITY = (
    "run",
    "viewer",
    "tracker",
    "label",
    "budget.costs",
    "renderer.scene",
    "renderer.workers",
    "renderer.cluster",
    "evaluation.evaluator.cache",
    "evaluation.evaluator.lpips",
)
"""Parts of the configuration that do not decide what a run computes: names, places, helpers."""


RENDERED_HASH = "_rendered_hash_"
"""In scene.json, as Hydra's own keys are written: no argument of what reads the scene."""


def scene_folder(path: str) -> str:
    """Name of the folder of a scene, which is given by that or by its XML file."""
    place = Path(path).resolve()
    return (place.parent if place.is_file() else place).name


def sweep_names() -> str:
    """Of all sweeps that come with the program, in lines that help texts have room for."""
    names = sorted(file.stem for file in (root() / "sweeps").glob("*.yaml"))
    return fill(", ".join(names), width=96, subsequent_indent="  ")


RESOLVERS: dict[str, Callable[..., Any]] = {
    "run_name": run_name,
    "said_overrides": said_overrides,
    "run_group": run_group,
    "choice": choice,
    "fast_precision": fast_precision,
    "network_width": network_width,
    "network_depth": network_depth,
    "bootstrap_batches": bootstrap_batches,
    "warmup_steps": warmup_steps,
    "folder_name": scene_folder,
    "sweep_names": sweep_names,
    "absolute_path": lambda *parts: str(Path(*parts).absolute()),
    "cache_folder": lambda: str(cache_folder()),
}
"""What conf/ asks for by ${name:…}."""


def register() -> None:
    """Makes scene folders options of the group `scene`, and the resolvers known to OmegaConf."""
    os.environ["NGI_ROOT"] = str(root())
    store = ConfigStore.instance()
    for name, arguments in scenes().items():
        reader = {"_target_": "ngi.scene.read_scene", **arguments}
        store.store(group="scene", name=name, node={"name": name, "reader": reader})
    for name, resolver in RESOLVERS.items():
        OmegaConf.register_new_resolver(name, resolver, replace=True)


def composed(*overrides: str) -> DictConfig:
    """The configuration that these words of a command line give."""
    register()
    with hydra.initialize_config_dir(str(root() / "conf"), version_base="1.3"):
        return hydra.compose("train", list(overrides))


def scene_place(config: DictConfig) -> dict[str, Any] | None:
    """What reads the scene, and from where, so that the run is found its scene again.

    The reader's `_target_` and arguments, paths absolute; None for scenes of closed formulas.
    """
    if "scene" not in config.renderer:
        return None
    place = plain(config.scene.reader)
    for key in ("folder", "path"):
        if key in place:
            place[key] = str(Path(place[key]).resolve())
    return place


def scene_record(config: DictConfig) -> dict[str, Any] | None:
    """What a run's scene.json says: `scene_place`, and the `SceneDescription.rendered_hash`."""
    place = scene_place(config)
    if place is None:
        return None
    description = instantiate(config.scene.reader, _convert_="all")
    return {**place, RENDERED_HASH: description.rendered_hash}


def run_settings(config: DictConfig, *, scene_hash: str, costs: Costs | None) -> dict[str, Any]:
    """What decides the result. Scene and costs count by content, not by where they lie."""
    settings = plain(config)
    for key in NOT_IDENTITY:
        *path, last = key.split(".")
        parent = settings
        for part in path:
            parent = parent[part]
        parent.pop(last, None)
    settings["scene"] = {"name": config.scene.name, "hash": scene_hash}
    settings["costs"] = costs
    settings["version"] = ngi.__version__
    return settings
