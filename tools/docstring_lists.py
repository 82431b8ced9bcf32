"""Shows what docstrings say of parameters as lists; an extension of Griffe, for the documentation.

A line `name: what it is`, at the beginning of a paragraph or after such a line, is an item; what
is indented below it, or goes on in the next line, belongs to it.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

ITEM = re.compile(r"^(\w+(?:, \w+)*): (?=\S)")


class DocstringLists(griffe.Extension):
    """Changes docstrings once they are read."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called for every module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(text: str) -> str:
    """The docstring with its parameters as a list."""
    lines: list[str] = []
    in_list = False
    for line in text.splitlines():
        if item := ITEM.match(line):
            lines += [] if in_list else [""]
            lines.append(f"- **{item[1]}**: {line[item.end() :]}")
            in_list = True
        elif in_list and line.strip():
            ends = line.startswith("Raises ")
            lines += ["", line] if ends else [f"    {line.strip()}"]
            in_list = not ends
        else:
            in_list = in_list and bool(line.strip())
            lines.append(line)
    return "\n".join(lines)
