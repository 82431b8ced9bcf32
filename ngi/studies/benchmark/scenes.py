"""The scenes that are measured: shipped ones by name, the authors' by folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ngi.scene import SceneDescription, read_scene, scenes
from ngi.scene.release import read_release


@dataclass(frozen=True)
class Scene:
    """A scene, how any process reads it, and what `ngi.train` is told to train on it."""

    name: str
    read: Callable[[], SceneDescription]
    overrides: tuple[str, ...]


def shipped(names: Iterable[str]) -> list[Scene]:
    """KeyError for a name that `ngi.scene.scenes` does not know."""
    known = scenes()
    return [Scene(n, partial(read_scene, **known[n]), (f"scene={n}",)) for n in names]


def released(folder: Path) -> Scene:
    """In the format of the paper's released program; FileNotFoundError without a scene.xml."""
    if not (folder / "scene.xml").is_file():
        raise FileNotFoundError(f"{folder}: no scene.xml is there; name the folder of a scene")
    overrides = ("scene=release", f"scene.path={folder}")
    return Scene(f"release {folder.resolve().name}", partial(read_release, folder), overrides)


def one_per_folder() -> list[str]:
    """Names of all scenes; of a scene's variants that with the most variables."""
    largest: dict[str, tuple[int, str]] = {}
    for name, arguments in scenes().items():
        variant = (arguments["dimensions"] or 0, name)
        largest[arguments["folder"]] = max(variant, largest.get(arguments["folder"], variant))
    return sorted(name for _, name in largest.values())
