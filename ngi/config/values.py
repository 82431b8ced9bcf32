"""Finds values of a configuration that its parts cannot be made with, before any is made."""

import inspect
import math
from collections.abc import Callable, Iterator
from difflib import get_close_matches
from functools import cache
from pkgutil import resolve_name
from types import NoneType, UnionType
from typing import Any, Union, Unpack, get_args, get_origin, get_type_hints

from omegaconf import DictConfig, OmegaConf

from ngi.files.resources import config_groups, root

LARGEST_INTEGER = 2**31 - 1
"""What fits everywhere: into tensors' sizes, Mitsuba's parameters, random seeds."""

_KINDS = {int: "an integer", float: "a finite number", bool: "true or false", str: "a text"}
_BESIDE: dict[str, Any] = {
    "seed": int,
    "evaluation.count": int,
    "run.checkpoint_seconds": float,
    "run.checkpoint_steps": int | None,
    "run.linear_megabytes": float,
    "run.on_code_change": str,
    "run.viewer_port": int,
    "viewer": bool,
}
"""Kinds of values that are no argument of a class."""


OWN_OPTIONS = ("evaluation", "reuse", "scene")
"""Groups whose options have no class, but keys of their own."""

_OF_STUDIES = ("ceiling",)
"""Keys that an experiment adds for what is started by another command."""


def check_values(config: DictConfig) -> None:
    """ValueError, naming key and value, for one that is not of the kind its class says.

    A key that nothing reads is refused, too: misspelt, it would be without effect.

    Checked are numbers, true and false, and texts; integers have at most 31 bits, and no number is
    NaN or infinite. What a class accepts beyond that it says itself.
    """
    _check_keys(config)
    for key, value, kind in (*_arguments(config, ""), *_others(config)):
        kinds = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
        if isinstance(value, DictConfig) and "_target_" in value:
            continue  # an object, whatever its class
        wanted = [_KINDS[k] for k in kinds if k in _KINDS]
        open_ended = any(get_origin(k) is not None or not inspect.isclass(k) for k in kinds)
        if not wanted or open_ended or any(_fits(value, k) for k in kinds):
            continue
        wanted += ["null"] * (NoneType in kinds)
        text = repr(value)
        shown = text if len(text) < 60 else f"{text[:40]}…"
        raise ValueError(f"{key}: {shown} is not {' or '.join(wanted)} that can be used here")


def _check_keys(config: DictConfig) -> None:
    """Of the whole and of what has no class; the parts with one are checked where they are made."""
    for name, known in _known_keys().items():
        node, path = (config[name], f"{name}.") if name else (config, "")
        for key in node:
            if key not in known:
                near = get_close_matches(str(key), {*known, "sweeps"}, n=1, cutoff=0.8)
                if name in OWN_OPTIONS and not near:
                    continue  # an option of one's own may keep values for others to refer to
                right = "+sweeps" if near == ["sweeps"] else "".join([path, *near])
                meant = f"; did you mean '{right}'?" if near else "; leave it out"
                raise ValueError(f"{path}{key!s}: nothing reads this key{meant}")


@cache
def _known_keys() -> dict[str, set[str]]:
    """Of the whole configuration, '', and of the parts without a class, by their names.

    Read once, however many runs a sweep has.
    """
    conf = root() / "conf"
    base = OmegaConf.load(conf / "train.yaml")
    known = {"": {*map(str, base), *config_groups(), *_OF_STUDIES}, "run": set(map(str, base.run))}
    for group in OWN_OPTIONS:
        options = [OmegaConf.load(file) for file in (conf / group).glob("*.yaml")]
        known[group] = {str(key) for option in options for key in option}
    return known


def _arguments(node: DictConfig, path: str) -> Iterator[tuple[str, Any, Any]]:
    """Key, value and annotation of every argument that a class of the configuration is given."""
    hints = _hints(_target(node["_target_"], f"{path}_target_")) if "_target_" in node else {}
    for name in node:
        value, key = node[name], f"{path}{name!s}"
        if name in hints:
            yield key, value, hints[name]
        if isinstance(value, DictConfig) and key not in ("hydra", "label"):
            yield from _arguments(value, f"{key}.")


def _others(config: DictConfig) -> Iterator[tuple[str, Any, Any]]:
    for key, kind in _BESIDE.items():
        value: Any = config
        for name in key.split("."):
            value = value[name]
        yield key, value, kind


def _target(name: str, key: str) -> Callable[..., Any]:
    try:
        target: Callable[..., Any] = resolve_name(name)
    except (ImportError, AttributeError) as error:
        where = "; PYTHONPATH=. adds this folder" if isinstance(error, ImportError) else ""
        raise ValueError(f"{key}: '{name}' cannot be imported: {error}{where}") from error
    return target


@cache
def _hints(target: Callable[..., Any]) -> dict[str, Any]:
    function = target.__init__ if inspect.isclass(target) else target
    try:
        hints = get_type_hints(function)
    except (NameError, TypeError):  # imported for the type checker only
        return {}
    for hint in [hint for hint in hints.values() if get_origin(hint) is Unpack]:
        hints |= get_type_hints(get_args(hint)[0])
    return hints


def _fits(value: object, kind: type) -> bool:
    if kind in (int, float) and isinstance(value, bool):
        return False
    if kind is int:
        return isinstance(value, int) and abs(value) <= LARGEST_INTEGER
    if kind is float:
        small = not isinstance(value, int) or abs(value) <= LARGEST_INTEGER**2
        return isinstance(value, int | float) and small and math.isfinite(value)
    return isinstance(value, kind)
