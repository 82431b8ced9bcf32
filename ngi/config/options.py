"""`key=value` on the command lines of small programs, as `ngi train` takes it, checked by type."""

import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, field, fields
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast

from pydantic import TypeAdapter, ValidationError

from ngi.config.unread_output import readers_may_leave
from ngi.machine.memory import keep_freed_memory

Options = TypeVar("Options")


def option(text: str, default: Any = MISSING) -> Any:
    """A field of a dataclass of options. text: for --help; without a default it must be given."""
    return field(default=default, metadata={"help": text})


def read_options(kind: type[Options], program: str, arguments: Sequence[str]) -> Options:
    """A `kind`, whose fields are made by `option`, from `key=value` arguments.

    A list is `[a,b]`, or its key given once for each item, whatever characters that has; of other
    values the last one counts. A word without a key is the value of the first field, which takes
    several if it is a list.
    Ends the program with status 0 where help is asked for, its text being `kind`'s docstring and
    its fields', and with status 2 and a message for an unknown or missing key or a wrong value.
    """
    if {"-h", "--help"} & set(arguments):
        print(_help(kind, program))
        sys.exit(0)
    entries = {entry.name: str(entry.type) for entry in fields(cast("Any", kind))}
    given: dict[str, list[str]] = {}
    for word in _with_key(arguments, *next(iter(entries.items()), ("", ""))):
        key, equals, text = word.partition("=")
        if key not in entries or not equals:
            known = f"there are {', '.join(sorted(entries))}" if entries else "there are none"
            _refuse(program, f"'{key}' is no option; {known}")
        given.setdefault(key, []).append(text)
    values: dict[str, str | list[str]] = {}
    for key, texts in given.items():
        if entries[key].startswith("list"):
            values[key] = [item for text in texts for item in _items(text)]
        else:
            values[key] = texts[-1]
    try:
        return TypeAdapter(kind).validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = str(first["loc"][0])
        if key not in given:
            _refuse(program, f"give {key}=…")
        _refuse(program, f"'{key}={given[key][-1]}' is wrong: {first['msg'].lower()}")


def _items(text: str) -> list[str]:
    """Of `[a,b]`, or the text itself: run folders have commas in their names."""
    if not (text.startswith("[") and text.endswith("]")):
        return [text]
    return [item.strip() for item in text[1:-1].split(",")]


def _with_key(words: Sequence[str], key: str, kind: str) -> list[str]:
    """Words of a command line; this key is given to those without, to one only unless a list's."""
    bare = [number for number, word in enumerate(words) if not re.match(r"-|\w+=", word)]
    named = bare if kind.startswith("list") else bare[:1] if key else []
    return [f"{key}={word}" if number in named else word for number, word in enumerate(words)]


def check_output(out: Path, *suffixes: str) -> None:
    """ValueError for a file that ends with none of these, or whose folder is not there."""
    if out.suffix not in suffixes:
        raise ValueError(f"out: '{out}' does not end with {' or '.join(suffixes)}")
    if not out.parent.is_dir():
        raise ValueError(f"out: the folder {out.parent} does not exist")


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
    keep_freed_memory()
    try:
        with readers_may_leave():
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
    width = 2 + max((len(name) for name, _ in rows), default=0)
    lines = [f"  {name:{width}}{text}" for name, text in rows]
    usage = f"{program} key=value …" if rows else program
    return "\n".join([f"{usage}\n", (kind.__doc__ or "").strip(), "", *lines])


def _shown(entry: Field[Any]) -> str:
    if entry.default is MISSING:
        return f"{entry.name}=…"
    return f"{entry.name}={'' if entry.default is None else entry.default}"
