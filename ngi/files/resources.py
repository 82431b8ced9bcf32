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


def scene_folders() -> dict[str, Path]:
    """Every scene folder by name: shipped ones, ./scenes, and those in $NGI_SCENES.

    A scene folder holds a scene.yaml; of two with one name, the later of these places wins.
    """
    places = [root() / "scenes", Path.cwd() / "scenes"]
    if "NGI_SCENES" in os.environ:
        places += [Path(part) for part in os.environ["NGI_SCENES"].split(os.pathsep) if part]
    return {
        file.parent.name: file.parent.resolve()
        for place in places
        for file in sorted(place.glob("*/scene.yaml"))
    }


def cache_folder() -> Path:
    """Where references are kept between runs: $NGI_CACHE, or ~/.cache/ngi."""
    named = os.environ.get(CACHE_VARIABLE)
    return Path(named) if named else Path.home() / ".cache" / "ngi"
