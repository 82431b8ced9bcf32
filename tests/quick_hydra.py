"""Hydra and OmegaConf do much again and again that a test need not wait for; here once, or not.

Each file of conf/ is parsed once per process, and in processes that are forked from one which has
read it not at all: PyYAML parses in Python, and OmegaConf makes a class for every file. So is each
`${…}`. What those of a defaults list may name is gathered only where it has one. That a number or a
string is no dataclass is known without asking. A configuration is the same, in two thirds of the
time.
"""

from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import IO, Any

import yaml
from hydra._internal import defaults_list
from omegaconf import DictConfig, ListConfig, OmegaConf, _utils, base
from omegaconf._utils import get_yaml_loader

LOADER = get_yaml_loader()
PLAIN = (str, int, float, bool, type(None), dict, list)
"""Types whose values are no structured configuration."""

_load = OmegaConf.load
_choices = defaults_list._create_interpolation_map
_kinds = _utils.is_dataclass, _utils.is_attr_class
_words = cache(base.parse)


def use() -> None:
    """From now on, in this process."""
    OmegaConf.load = staticmethod(load)  # type: ignore[method-assign, assignment]
    defaults_list._create_interpolation_map = choices
    _utils.is_dataclass, _utils.is_attr_class = map(asked_of_objects, _kinds)
    base.parse = _utils.parse = _words


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


def choices(overrides: Any, defaults: list[Any], self_added: bool) -> DictConfig | None:
    """What the words of these defaults are looked up in; None where they have none."""
    if not any(each.is_interpolation() for each in defaults):
        return None
    return _choices(overrides, defaults, self_added)


def asked_of_objects(kind: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """The same question, whose answer is no for what is plain."""

    @wraps(kind)
    def asked(value: Any) -> bool:
        return type(value) not in PLAIN and kind(value)

    return asked


@cache
def _parsed(text: str) -> Any:
    return yaml.load(text, Loader=LOADER)
