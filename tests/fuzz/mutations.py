"""Makes bad scene files of good ones, always the same for the same random numbers."""

from __future__ import annotations

import copy
from collections.abc import Callable
from random import Random
from typing import Any
from xml.etree import ElementTree

import yaml

Mutation = Callable[[Random, bytes], bytes]

VALUES: tuple[Any, ...] = (
    float("nan"),
    float("inf"),
    1e309,
    1e308,
    -0.0,
    -1,
    0,
    2**31,
    2**64,
    10**400,
    1e-320,
    "",
    "word",
    "$name",
    "../outside",
    "/dev/zero",
    "a" * 5000,
    "ü\u202e\U0001f980",
    "nul\0",
    None,
    True,
    [],
    [[]],
    {},
    {"a": {"b": []}},
    [1, 2, 3],
    ["x", "x"],
)
TEXTS = (
    b"\0",
    b"\xff\xfe",
    "ü\u2028".encode(),
    b"[" * 2000,
    b"{a: " * 500,
    b"&a [*a]",
    b"<a>" * 2000,
    b"!!python/object:os.system x",
    b"!!int ''",
    b"!!timestamp x",
    b"2001-13-45",
    b"<<: ",
    b"---\n",
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>",
    b"&b;",
    b"$" * 50,
    b"1" * 5000,
    b'"',
    b"'",
    b"\t",
)


def mutated(random: Random, text: bytes, *, xml: bool) -> bytes:
    """Some changes of what the text says, or else of its letters: those mostly break its syntax."""
    if random.random() < 0.2:
        return random.choice((_bytes, _lines))(random, text)
    change = _xml_tree if xml else _yaml_tree
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        text = change(random, text)
    return text


def _bytes(random: Random, text: bytes) -> bytes:
    at = random.randrange(len(text) + 1)
    length = random.choice((1, 1, 4, 40))
    match random.randrange(4):
        case 0:
            return text[:at]
        case 1:
            return text[:at] + random.randbytes(length) + text[at + length :]
        case 2:
            return text[:at] + random.choice(TEXTS) + text[at:]
    return text[:at] + text[at + length :]


def _lines(random: Random, text: bytes) -> bytes:
    lines = text.split(b"\n")
    line = lines.pop(random.randrange(len(lines)))
    for _ in range(random.choice((0, 1, 2))):
        lines.insert(random.randrange(len(lines) + 1), line)
    return b"\n".join(lines)


def _yaml_tree(random: Random, text: bytes) -> bytes:
    try:
        top = yaml.safe_load(text)
    except Exception:  # an earlier change has broken it
        return _bytes(random, text)
    places = list(_places(top))
    if not places:
        return text
    holder, key = random.choice(places)
    match random.randrange(4):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[random.choice((f"{key}x", "files", "choices", 3))] = holder.pop(key)
        case 2:
            other, name = random.choice(places)
            holder[key] = copy.deepcopy(other[name]) if _there(other, name) else None
        case _:
            holder[key] = random.choice(VALUES)
    return yaml.safe_dump(top, allow_unicode=True).encode("utf-8", "surrogatepass")


def _places(value: Any) -> Any:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(items):
        yield value, key
        if isinstance(inner, dict | list):
            yield from _places(inner)


def _there(holder: Any, key: Any) -> bool:
    return key in holder if isinstance(holder, dict) else key < len(holder)


def _xml_tree(random: Random, text: bytes) -> bytes:
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError):
        return _bytes(random, text)
    elements = list(root.iter())
    parents = {child: parent for parent in elements for child in parent}
    one, other = random.choice(elements), random.choice(elements)
    match random.randrange(6):
        case 0 if one in parents:
            parents[one].remove(one)
        case 1:
            other.append(copy.deepcopy(one))
        case 2:
            one.tag = other.tag
        case 3 if one.attrib:
            name = random.choice(list(one.attrib))
            value = one.attrib.pop(name)
            one.set(random.choice(("id", "type", "name", "value", "filename")), value)
        case 4 if one.attrib:
            names = list(other.attrib.values()) or ["x"]
            one.set(random.choice(list(one.attrib)), random.choice(names))
        case _ if one.attrib:
            one.set(random.choice(list(one.attrib)), _xml_text(random.choice(VALUES)))
    return ElementTree.tostring(root)


def _xml_text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
