"""`key=value` on the command lines of small programs, as `ngi.train` takes it, checked by type."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, field, fields
from typing import Any, NoReturn, TypeVar, cast

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

Options = TypeVar("Options")

_WORDS = {
    "int": "an integer",
    "float": "a number",
    "bool": "true or false",
    "str": "a text",
    "str | None": "a text",
    "list[float] | None": "a list of numbers, such as [0.5,0.2]",
}
"""For the annotations of options."""


def option(text: str, default: Any = MISSING) -> Any:
    """A field of a dataclass of options. text: for --help; without a default it must be given."""
    return field(default=default, metadata={"help": text})


def read_options(kind: type[Options], program: str, arguments: Sequence[str]) -> Options:
    """A `kind`, whose fields are made by `option`, from `key=value` arguments in YAML's notation.

    Ends the program with status 0 where help is asked for, its text being `kind`'s docstring and
    its fields', and with status 2 and a message for an unknown or missing key or a wrong value.
    """
    if {"-h", "--help"} & set(arguments):
        print(_help(kind, program))
        sys.exit(0)
    given = [argument.partition("=") for argument in arguments]
    known = {entry.name: entry.type for entry in fields(cast("Any", kind))}
    for key, equals, _ in given:
        if key not in known or not equals:
            _refuse(program, f"'{key}' is no option; there are {', '.join(sorted(known))}")
    required = {e.name for e in fields(cast("Any", kind)) if e.default is MISSING}
    if missing := sorted(required - {key for key, _, _ in given}):
        _refuse(program, f"give {missing[0]}=…")
    values = OmegaConf.structured(kind)
    for argument, (key, _, _) in zip(arguments, given, strict=True):
        try:
            values = OmegaConf.merge(values, OmegaConf.from_dotlist([argument]))
        except (OmegaConfBaseException, YAMLError):
            _refuse(program, f"'{argument}' is wrong: {key} is {_WORDS[str(known[key])]}")
    return cast("Options", OmegaConf.to_object(values))


def run_tool(
    work: Callable[[Options], int | None],
    kind: type[Options],
    program: str,
    arguments: Sequence[str] | None = None,
) -> int:
    """Does what `PROGRAM key=value …` asks for, and returns its exit status.

    kind: of the options, see `read_options`; program: `ngi VERB`, as messages call it
    arguments: those of the command line where None
    What `work` returned, 0 for None; 2 where it raised ValueError, OSError or RuntimeError, which
    is printed; 130 after Ctrl-C.
    """
    options = read_options(kind, program, sys.argv[1:] if arguments is None else arguments)
    try:
        status = work(options)
    except (ValueError, OSError, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return status or 0


def _refuse(program: str, problem: str) -> NoReturn:
    print(f"{program}: {problem}; --help says more", file=sys.stderr)
    sys.exit(2)


def _help(kind: type, program: str) -> str:
    rows = [(_shown(entry), entry.metadata["help"]) for entry in fields(kind)]
    width = 2 + max(len(name) for name, _ in rows)
    lines = [f"  {name:{width}}{text}" for name, text in rows]
    return "\n".join([f"{program} key=value …\n", (kind.__doc__ or "").strip(), "", *lines])


def _shown(entry: Field[Any]) -> str:
    if entry.default is MISSING:
        return f"{entry.name}=…"
    return f"{entry.name}={'' if entry.default is None else entry.default}"
