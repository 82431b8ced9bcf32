"""Where the configuration, the scenes and the sweeps lie: in the repository or in the wheel."""

import os
from pathlib import Path

CACHE_VARIABLE = "NGI_CACHE"
"""The environment variable that says where `cache_folder` is."""

_PACKAGE = Path(__file__).resolve().parents[1]


def root() -> Path:
    """The folder that holds conf/, scenes/ and sweeps/."""
    repository = _PACKAGE.parent
    return repository if (repository / "conf" / "train.yaml").exists() else _PACKAGE / "_data"


def config_groups() -> set[str]:
    """Names of what can be chosen, `name=option`: the folders of conf/."""
    return {folder.name for folder in (root() / "conf").iterdir() if folder.is_dir()}


def config_options(group: str) -> list[str]:
    """What can be chosen for a group, or for a folder in one, such as `method/ours_without`."""
    found = {file.stem for file in (root() / "conf" / group).glob("*.yaml")}
    return sorted(found.union(scene_folders() if group == "scene" else ()))


def scene_places() -> list[Path]:
    """Folders of scene folders: of the shipped scenes, ./scenes, and those in $NGI_SCENES."""
    named = os.environ.get("NGI_SCENES", "").split(os.pathsep)
    return [root() / "scenes", Path.cwd() / "scenes", *(Path(place) for place in named if place)]


def scene_folders() -> dict[str, Path]:
    """Every scene folder of `scene_places` by name.

    A scene folder holds a scene.yaml; of two with one name, the later of these places wins.
    """
    return {
        file.parent.name: file.parent.resolve()
        for place in scene_places()
        for file in sorted(place.glob("*/scene.yaml"))
    }


def cache_folder() -> Path:
    """Where references are kept between runs: $NGI_CACHE, or ~/.cache/ngi."""
    named = os.environ.get(CACHE_VARIABLE)
    return Path(named) if named else Path.home() / ".cache" / "ngi"
