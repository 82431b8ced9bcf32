"""Programs that Hydra configures: what is wrong is said once, with the nearest of what there is."""

import logging
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from traceback import format_exception
from typing import Any, NoReturn

from hydra.core.hydra_config import HydraConfig
from hydra.errors import (
    CompactHydraException,
    ConfigCompositionException,
    InstantiationException,
    MissingConfigException,
    OverrideParseException,
)
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ngi.config.command_words import MULTIRUN, in_order
from ngi.config.unread_output import readers_may_leave
from ngi.files.extras import install_command
from ngi.files.resources import config_groups, config_options, scene_places

LAUNCHERS = {"joblib": "joblib", "submitit_local": "slurm", "submitit_slurm": "slurm"}
"""Options of hydra/launcher that are packages of their own: the extra that each is in."""

log = logging.getLogger(__name__)

TOLD = (ValueError, OSError, RuntimeError, FloatingPointError, TypeError, ImportError)
MESSAGES = (*TOLD, InstantiationException)
"""Exceptions whose text says to users what is wrong; all others are bugs."""

WITH_LESS_MEMORY = (
    "the GPU is out of memory: free some (`nvidia-smi` lists its users), or lower sampler.chains, "
    "model.hidden_features or renderer.workers; the same command resumes from the last checkpoint"
)

KILLED = ("UncompletedJobError", "TerminatedWorkerError")
"""What Submitit and joblib raise where a job's process has ended without an answer."""

FULL_ERROR = "HYDRA_FULL_ERROR"
"""The environment variable that makes Hydra raise errors, which it would print otherwise."""
NOT_FOR_USERS = ("hydra", "label")
"""Parts of the configuration in which nobody means to change a key."""


def run_program(program: Callable[[], None], *, folder_option: str = "run.folder") -> None:
    """Calls a function that `hydra.main` has made.

    Where its configuration cannot be composed, or a job of a sweep has failed or was killed by the
    system, the process ends with status 1 and one message, after Ctrl-C with status 130. Who sets
    HYDRA_FULL_ERROR=1 gets Hydra's own exceptions with their tracebacks; that of a job's error is
    in its log file (`job_of`).

    folder_option: what chooses the folder that Hydra writes to
    """
    if os.environ.get(FULL_ERROR) == "1":
        program()
        return
    os.environ[FULL_ERROR] = "1"
    sys.argv[1:] = in_order(sys.argv[1:])
    try:
        with readers_may_leave():
            program()
    except (CompactHydraException, OmegaConfBaseException) as error:
        sys.exit(explained(error))
    except (OSError, ValueError) as error:  # where Hydra makes the folder, or its log in there
        if str(error).startswith("Only one of --run"):
            sys.exit(f"{error}; to see the settings of one run of a sweep, leave out -m: --cfg job")
        if str(error).startswith("Config group override must be"):
            sys.exit(_about_number(error))
        cause = error if isinstance(error, OSError) else error.__cause__
        if not isinstance(cause, OSError):
            raise
        advice = f"choose another folder with {folder_option}=…, or change its permissions"
        sys.exit(f"{cause}; {advice}")
    except RuntimeError as error:
        if type(error).__name__ not in KILLED:
            raise
        sys.exit(" ".join(str(error).splitlines()[:2]).strip())  # the job's log may follow
    except KeyboardInterrupt:
        sys.exit(130)


@contextmanager
def job_of(name: str) -> Iterator[None]:
    """What a job does, so that its errors are told, and kept in its log file.

    name: the job's folder or name
    """
    try:
        yield
    except MESSAGES as error:
        fail(error, job=name)
    except Exception as error:  # a bug, which ends with its traceback
        _keep_traceback(error)
        raise


def fail(error: Exception, *, job: str) -> NoReturn:
    """Ends a job whose error says to users what is wrong. job: its folder or name

    A single one ends the process. Jobs of a sweep leave that to Hydra, which lets the others run
    and reports only the first that has failed: each says for itself what was wrong. The traceback
    is kept in the job's log file.
    """
    message = in_plain_words(error)
    log.error("%s", message)
    _keep_traceback(error)
    if HydraConfig.get().mode is RunMode.RUN:
        raise SystemExit(1) from error
    what = "see above" if _shares_the_terminal() else message
    raise CompactHydraException(f"{job} failed: {what}") from error


def _keep_traceback(error: Exception) -> None:
    """In the log file, not on the terminal: where an error is in a class of the user's own."""
    traceback = "".join(format_exception(error)).rstrip()
    record = log.makeRecord(log.name, logging.ERROR, __file__, 0, traceback, (), None)
    for handler in logging.getLogger().handlers:
        if isinstance(handler, logging.FileHandler):
            handler.handle(record)


def in_plain_words(error: Exception) -> str:
    """Without the class that could not be made, with the part of the configuration it is for."""
    cause = error.__cause__
    if type(error).__name__ == "OutOfMemoryError":  # of PyTorch, which need not be imported
        return f"{error}\n{WITH_LESS_MEMORY}"
    if not (isinstance(error, InstantiationException) and isinstance(cause, TOLD)):
        return str(error)
    key = str(error).rpartition("full_key: ")[2]
    if found := re.search(r"__init__\(\) got an unexpected keyword argument '(\w+)'", str(cause)):
        unknown = f"{key}.{found[1]}"
        return f"{unknown}: this {key} has no such setting; leave it out: ~{unknown}"
    if absent := re.search(r"__init__\(\) missing \d+ required .*?: (.+)", str(cause)):
        return (
            f"{key}: missing {absent[1]}; a setting is given as {key}.NAME=…, what the program "
            f"gives needs `_partial_: true` beside {key}._target_"
        )
    return str(cause) if key in str(cause) else f"{key}: {cause}"


def explained(error: Exception) -> str:
    """What Hydra has found wrong; of a key or an option that does not exist also the nearest."""
    cause = error.__cause__
    if isinstance(error, MissingConfigException) and error.options is not None:
        group, _, option = str(error.missing_cfg_file).rpartition("/")
        # of a folder in a group Hydra lists what the group has
        options = (config_options(group) if "/" in group else []) or error.options
        near = get_close_matches(option, options, n=1)
        group = "scene" if group.startswith("scene/") else group  # a path, not a name
        where = _about_scenes(option) if group == "scene" else ""
        if option in LAUNCHERS:
            where = f"; install it with {install_command(LAUNCHERS[option])}"
        return (
            f"{error.missing_cfg_file}: there is no such option; "
            f"{group} can be {', '.join(options)}{where}{_question(near)}"
        )
    if isinstance(cause, AttributeError | KeyError) and isinstance(cause, OmegaConfBaseException):
        return _about_key(cause)
    if isinstance(error, OverrideParseException):
        return _about_word(error)
    if added := re.search(r"To append to your default list use (\+(\w+)=\S+)", str(error)):
        multirun = ", with -m" * (added[2] == "sweeps")
        return f"{added[2]}: give it with a plus{multirun}: {added[1]}"
    if isinstance(error, ConfigCompositionException) and str(error).startswith("Ambiguous"):
        return str(error).replace("add --multirun to your command line", "give -m")
    if missing := re.search(r"Missing mandatory value: (\S+)", str(error)):
        return f"{missing[1]}: it has to be given, {missing[1]}=…"
    told = isinstance(cause, OmegaConfBaseException)
    return f"{error}\n{cause}" if told else str(error)


def _about_scenes(name: str) -> str:
    for folder in (place / name for place in scene_places()):
        if (folder / "scene.xml").is_file():
            return f"; {folder} has no scene.yaml, `ngi describe {folder / 'scene.xml'}` writes one"
    return "; scenes are folders in ./scenes and $NGI_SCENES"


def _about_number(error: Exception) -> str:
    """error: of the first word that gives a number, or true or false, to a group of options; where
    there is none, it is in a file.
    """
    for word in sys.argv[1:]:
        group, _, value = word.lstrip("+").partition("=")
        if group in config_groups() and re.match(r"[-+.\d]|(true|false)$", value, re.IGNORECASE):
            hint = "; a number of seconds is budget.seconds=…" if group == "budget" else ""
            return f"{word}: {group} can be {', '.join(config_options(group))}{hint}"
    return str(error)


def _about_word(error: OverrideParseException) -> str:
    if "=" not in error.override:
        return f"'{error.override}': write key=value, without spaces around the ="
    problem = error.message.removeprefix(f"Error parsing override '{error.override}'").strip()
    return f"'{error.override}': {problem}"


def _about_key(error: OmegaConfBaseException) -> str:
    """error: of a key that its `parent_node` does not have"""
    key, full_key, parent = str(error.key), str(error.full_key), error.parent_node
    above = full_key.removesuffix(key)
    known = list(_keys(OmegaConf.to_container(parent))) if isinstance(parent, DictConfig) else []
    known += () if above else sorted(config_groups() - set(known))
    near = get_close_matches(key, known, n=1) or [k for k in known if k.endswith(f".{key}")]
    swept = f"; if all options of the sweep have this key: ++{full_key}=…" * _sweeps()
    if near:
        return f"{full_key}: there is no such key{_question([above + near[0]])}{swept}"
    there = ", ".join(above + k for k in known if "." not in k) or "none"
    adds = isinstance(parent, DictConfig) and "_target_" in parent
    adding = swept or f" (+{full_key}=… adds one)" * adds
    return f"{full_key}: there is no such key; there are {there}{adding}"


def _sweeps() -> bool:
    return not set(MULTIRUN).isdisjoint(sys.argv)


def _question(near: list[str]) -> str:
    return f"; did you mean '{near[0]}'?" if near else ""


def _keys(values: Any, path: str = "") -> Iterator[str]:
    """Every key of nested mappings, with those above it: 'model.hidden_layers'."""
    for name, value in values.items():
        key = f"{path}{name}"
        if key not in NOT_FOR_USERS and not key.endswith("_"):  # such as _target_
            yield key
            if isinstance(value, dict):
                yield from _keys(value, f"{key}.")


def _shares_the_terminal() -> bool:
    """Whether what the job logs is shown where Hydra reports its failure.

    Jobs of Submitit, on this machine or in a cluster, log into files of their own only.
    """
    return "submitit" not in HydraConfig.get().launcher._target_
