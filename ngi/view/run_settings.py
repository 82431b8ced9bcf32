"""What a run's folder says of its parts, made again; nothing but what comes with this program."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any

from hydra.utils import get_object
from omegaconf import DictConfig, OmegaConf

from ngi.config.configuration import RENDERED_HASH
from ngi.evaluate import EvaluationProtocol
from ngi.files.durable import damage_named
from ngi.files.resources import root
from ngi.learn import PatchSamples, Samples
from ngi.render import Renderer
from ngi.render.workers import mitsuba_renderer
from ngi.scene import SceneDescription, read_scene, scenes
from ngi.scene.release import read_release

READERS: dict[str, Callable[..., SceneDescription]] = {
    "ngi.scene.read_scene": read_scene,
    "ngi.scene.release.read_release": read_release,
}

RENAMED = {
    "ngi.models.CNSR": "ngi.methods.cnsr.CNSR",
    "ngi.learn.ObservationSets": "ngi.methods.cnsr.ObservationSets",
    "ngi.models.AffinityDenoiser": "ngi.methods.anf.AffinityDenoiser",
    "ngi.learn.Sequences": "ngi.methods.anf.Sequences",
}
"""What older runs call something -> what it is called now."""


@dataclass(frozen=True, kw_only=True)
class OpenedRun:
    """What the folder of any run tells.

    protocol: that its evaluations measured by
    description: of its scene; None for closed formulas
    """

    folder: Path
    scene_name: str
    protocol: EvaluationProtocol
    description: SceneDescription | None
    renderer: Renderer


def opened(folder: Path, settings: dict[str, Any], scene_path: Path | str | None) -> dict[str, Any]:
    """The fields of an `OpenedRun`; raises as `describe_scene` and `make_renderer` do.

    scene_path: see `describe_scene`
    """
    description = describe_scene(folder, settings, scene_path)
    return {
        "folder": folder,
        "scene_name": settings["scene"]["name"],
        "protocol": EvaluationProtocol(**plain(settings["evaluation"]["evaluator"]["protocol"])),
        "description": description,
        "renderer": make_renderer(folder, settings, description),
    }


TRUSTED = "NGI_TRUSTED"
"""The environment variable that names modules, with commas between them, that a run may name."""


def read_settings(folder: Path) -> dict[str, Any]:
    """The run's settings.json; FileNotFoundError where there is none, ValueError if damaged."""
    path = folder / "settings.json"
    if not path.exists():
        below = (folder.glob("*/" * depth + path.name) for depth in range(1, 5))
        some = islice(chain.from_iterable(below), 3)
        such = " or ".join(str(file.parent) for file in some) or "outputs/…/seed=0 for example"
        raise FileNotFoundError(f"{path}: no such file; name the folder of one run, {such}")
    with damage_named(path):
        settings: dict[str, Any] = json.loads(path.read_text())
    return settings


@contextmanager
def settings_of(folder: Path) -> Iterator[dict[str, Any]]:
    """What `read_settings` gives, to open the run by; ValueError where that lacks something."""
    settings = read_settings(folder)
    try:
        yield settings
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"{folder}: settings.json or result.json is damaged, or from another version of "
            f"the program ({error!r})"
        ) from error


def made_by(settings: dict[str, Any], group: str) -> Callable[..., Any]:
    """What makes a part of the run: the `_target_` of one of the group's options in conf/.

    A run's folder may be somebody else's, and a `_target_` can name any function there is. Modules
    of one's own are taken where `TRUSTED` names them.
    """
    target = settings[group]["_target_"]
    if isinstance(target, str):
        target = RENAMED.get(target, target)
    options = [OmegaConf.load(file) for file in (root() / "conf" / group).glob("*.yaml")]
    known = {option.get("_target_") for option in options if isinstance(option, DictConfig)}
    own = {name.strip() for name in os.environ.get(TRUSTED, "").split(",")} - {""}
    trusted = isinstance(target, str) and (target in known or target.partition(".")[0] in own)
    if not trusted:
        raise ValueError(
            f"settings.json: {group}._target_ is '{target}', which is not part of this program (no "
            f"option of the group {group} names it). If it is your own code, set "
            f"{TRUSTED}={str(target).partition('.')[0]}"
        )
    make: Callable[..., Any] = get_object(target)
    return make


def make_samples(
    settings: dict[str, Any], renderer: Renderer, *, supersampled_edges: bool = False
) -> Samples:
    """What was trained on; patches, where the run is older than the group `data`.

    supersampled_edges: of images, though the run has them as its network is asked once. ValueError
        for a network of whole images
    Parts of it that are objects, such as a denoiser, are for new samples, which nobody asks for.
    """
    data = settings.get("data", {})
    make = made_by(settings, "data") if data else PatchSamples
    numbers = {k: v for k, v in plain(data).items() if not isinstance(v, dict)}
    if supersampled_edges:
        if make is not PatchSamples:
            raise ValueError(
                f"supersampled_edges: this run's network makes whole images from {make.__name__} "
                "and cannot be evaluated for quarters of a pixel; leave the option out"
            )
        numbers["supersampled_edges"] = True
    samples: Samples = make(**numbers, renderer=renderer)
    return samples


def plain(arguments: dict[str, Any]) -> dict[str, Any]:
    """Without Hydra's own keys."""
    return {name: value for name, value in arguments.items() if not name.startswith("_")}


def describe_scene(
    folder: Path, settings: dict[str, Any], path: Path | str | None
) -> SceneDescription | None:
    """What varies in the run's scene; None where it is made of closed formulas.

    path: of a scene in the authors' format. None: the scene is looked for where the run's folder
        says that it was, and then among the known scenes, by its name
    Raises ValueError where it is found nowhere.
    """
    name = settings["scene"]["name"]
    if made_by(settings, "renderer") is not mitsuba_renderer:
        return None
    if path is not None:
        return read_release(path)
    place = _remembered_place(folder)
    if place is not None and Path(place.get("folder", place.get("path", ""))).exists():
        return READERS[place["_target_"]](**plain(place))
    if name not in (known := scenes()):
        gone = "" if place is None else f", nor at {place.get('folder', place.get('path'))}"
        raise ValueError(
            f"scene '{name}' is not found{gone}: set NGI_SCENES to the folder that contains it, or "
            "give the folder of one of the paper authors' scenes with scene=FOLDER"
        )
    return read_scene(**known[name])


def _remembered_place(folder: Path) -> dict[str, Any] | None:
    """What scene.json says; None for runs of before there was one. ValueError if damaged."""
    path = folder / "scene.json"
    if not path.exists():
        return None
    with damage_named(path, "delete it"):
        place: dict[str, Any] = json.loads(path.read_text())
        if place["_target_"] not in READERS:
            raise ValueError(f"_target_ is {place['_target_']!r}, known are {list(READERS)}")
        if not isinstance(where := place.get("folder", place.get("path")), str):
            raise TypeError(f"it names {where!r} where the scene's folder belongs")
    return place


def make_renderer(
    folder: Path, settings: dict[str, Any], description: SceneDescription | None
) -> Renderer:
    """Of the scene as it was for the run, in this process, on whatever it has; else ValueError."""
    options = plain(settings["renderer"])
    if description is not None:
        options |= {"backend": "auto", "scene": description, "workers": 0, "cluster": None}
    renderer: Renderer = made_by(settings, "renderer")(**options)
    changed = renderer.scene_hash != settings["scene"]["hash"]
    if changed and not (description is not None and _renders_the_same(folder, description)):
        raise ValueError(
            f"{folder} was trained on an earlier version of '{settings['scene']['name']}'; its "
            "network does not know the scene as it is now"
        )
    return renderer


def _renders_the_same(folder: Path, description: SceneDescription) -> bool:
    """Whether nothing has changed that decides the scene's pixels."""
    place = _remembered_place(folder)
    return place is not None and place.get(RENDERED_HASH) == description.rendered_hash
