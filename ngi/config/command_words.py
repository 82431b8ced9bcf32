"""The words of a command line, before Hydra reads them: what they leave open, and their order.

Where the words name no budget, and no method or one of ours, that one (or else `method=ours`) is
trained at a size that suits this machine: `ngi train scene=X budget.seconds=60` gives the best
network that it can train in that time. Methods that are compared with ours have the same size.
Where they name no method, and a budget that is not the paper's, it is the one of ours that had the
least error there. Other methods alone, an experiment, a sweep or another budget, once named, are
taken at their word.
"""

import re
import sys
from collections.abc import Sequence
from typing import Any

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob
from hydra.errors import HydraException

from ngi.files.resources import config_options

MULTIRUN = ("-m", "--multirun")
SHOWING = ("-c", "--cfg", "-i", "--info", "-h", "--help", "--hydra-help")
"""Options with which nothing runs."""

BEST_METHOD = {"machine": "ours", "hour": "ours_small_patches", "scarce": "ours_small_patches"}
"""Of each budget for ours: what had the least error there, scene by scene, of what was tried
(docs/guide/sampler.md).
"""

CHOOSING = ("experiment", "sweeps", "path_tracing")
"""Groups whose choice says what is trained, and for how long."""


def completed(words: Sequence[str]) -> list[str]:
    """The words of a command line, with what they leave open of method and budget."""
    named = {
        word.partition("=")[0].lstrip("+"): word.partition("=")[2]
        for word in words
        if "=" in word and not word.startswith("-")
    }
    budgets = _options("budget", named.get("budget", "machine"))
    methods = _options("method", named.get("method", "ours"))
    with_ours = any(re.fullmatch(r"ours(_\w+)?(/\w+)?", method) for method in methods)
    best = {budget: BEST_METHOD.get(budget, "") for budget in budgets}
    known = bool(best) and all(best.values())
    if not known or not with_ours or any(group in named for group in CHOOSING):
        return list(words)
    if "method" not in named and len(set(best.values())) > 1:
        choices = ", ".join(f"{method} for {budget}" for budget, method in best.items())
        sys.exit(f"budget={named['budget']}: name a method=…; by themselves these train {choices}")
    ours = {"budget": "machine", "method": best[budgets[0]]}
    added = (f"{group}={choice}" for group, choice in ours.items() if group not in named)
    return with_overrides(words, *added)


def _options(group: str, word: str) -> list[str]:
    """Those of a configuration group that GROUP=WORD means; none where Hydra will refuse it."""
    try:
        override = OverridesParser.create().parse_override(f"{group}={word}")
    except HydraException:
        return []
    value: Any = override.value()
    if isinstance(value, Glob):
        return value.filter(config_options(group))
    if override.is_discrete_sweep():
        return [name.strip("'\"") for name in override.sweep_string_iterator()]
    return [str(value)]


def in_order(words: Sequence[str]) -> list[str]:
    """The words with -m before all others; argparse refuses overrides on both sides of an option.

    A folder is quoted where Hydra would refuse it.

    Raises SystemExit, with a message, for an option that Hydra does not have, and for a sweep of
    which a single run is asked for.
    """
    multirun = [word for word in words if word in MULTIRUN]
    sweep = next((word for word in words if word.startswith("+sweeps=")), None)
    if sweep and not multirun and not any(word.partition("=")[0] in SHOWING for word in words):
        sys.exit(f"{sweep}: a sweep needs -m, as it has several runs; --dry-run only lists them")
    ordered = [*multirun[:1], *(_quoted(word) for word in words if word not in MULTIRUN)]
    unknown = get_args_parser().parse_known_args(ordered)[1]
    if unknown and unknown[0].startswith("-"):
        name, _, value = unknown[0].lstrip("-").partition("=")
        sys.exit(
            f"{unknown[0]}: there is no such option; settings of a run are written without dashes: "
            f"{name}={value or '…'} (--help lists them)"
        )
    if unknown:
        sys.exit(f"{unknown[0]}: put options, such as -m, before all words without dashes")
    return ordered


def _quoted(word: str) -> str:
    """As it is, but for a folder with = in its name, as they have by themselves."""
    key, _, folder = word.partition("=")
    if key != "run.folder" or "=" not in folder or folder[0] in "'\"" or "'" in folder:
        return word
    return f"{key}='{folder}'"


def with_overrides(words: Sequence[str], *overrides: str) -> list[str]:
    """Hydra's command line with further overrides, before all others: those that follow win.

    Overrides have to stand together, which argparse asks for.
    """
    are_overrides = ("=" in word and word[0] != "-" for word in words)
    first = next((i for i, is_override in enumerate(are_overrides) if is_override), len(words))
    return [*words[:first], *overrides, *words[first:]]
