"""Hydra reads the same files of conf/ again and again; here each is parsed once per process.

Processes that are forked from one which has read them have them too. Parsing takes a fifth of a
configuration's time: PyYAML does it in Python, and OmegaConf makes a class for every file.
"""

from functools import cache
from pathlib import Path
from typing import IO, Any

import yaml
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf._utils import get_yaml_loader

LOADER = get_yaml_loader()
_load = OmegaConf.load


def use() -> None:
    """From now on, in this process."""
    OmegaConf.load = staticmethod(load)  # type: ignore[method-assign, assignment]


def load(file: str | Path | IO[Any]) -> DictConfig | ListConfig:
    """As `OmegaConf.load`, by the same loader."""
    if isinstance(file, str | Path):
        return _load(file)
    try:
        found = _parsed(file.read())
    except yaml.YAMLError:
        file.seek(0)
        return _load(file)  # whose message names the file
    return OmegaConf.create() if found is None else OmegaConf.create(found)


@cache
def _parsed(text: str) -> Any:
    return yaml.load(text, Loader=LOADER)
