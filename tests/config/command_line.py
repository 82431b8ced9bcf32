"""The program's configuration as the command line composes it, Hydra's own part included."""

import copy
import os
from functools import cache
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from ngi.config.configuration import register
from ngi.files.resources import root

CONF = root() / "conf"


def composed(*overrides: str) -> DictConfig:
    """The same words are composed once in a folder, as long as no variable of ours changes."""
    told = [(name, value) for name, value in os.environ.items() if name.startswith("NGI_")]
    config = copy.deepcopy(_composed(overrides, Path.cwd(), tuple(sorted(told))))
    HydraConfig.instance().set_config(config)
    return config


@cache
def _composed(
    overrides: tuple[str, ...],
    folder: Path,  # noqa: ARG001
    told: tuple[tuple[str, str], ...],  # noqa: ARG001
) -> DictConfig:
    register()
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return compose("train", list(overrides), return_hydra_config=True)
