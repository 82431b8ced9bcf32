"""Makes bad files of good ones, always the same for the same random numbers."""

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
        return random.choice((in_letters, in_lines))(random, text)
    change = _xml_tree if xml else _yaml_tree
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        text = change(random, text)
    return text


def in_letters(random: Random, text: bytes) -> bytes:
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


def in_lines(random: Random, text: bytes) -> bytes:
    lines = text.split(b"\n")
    line = lines.pop(random.randrange(len(lines)))
    for _ in range(random.choice((0, 1, 2))):
        lines.insert(random.randrange(len(lines) + 1), line)
    return b"\n".join(lines)


def _yaml_tree(random: Random, text: bytes) -> bytes:
    return in_tree(random, text, yaml.safe_load, _to_yaml)


def _to_yaml(top: Any) -> bytes:
    return yaml.safe_dump(top, allow_unicode=True).encode("utf-8", "surrogatepass")


def in_tree(
    random: Random, text: bytes, read: Callable[[bytes], Any], write: Callable[[Any], bytes]
) -> bytes:
    """One change of what a text says: something less, elsewhere, twice, negative, or nonsense."""
    try:
        top = read(text)
    except Exception:  # an earlier change has broken it
        return in_letters(random, text)
    places = list(_places(top))
    if not places:
        return text
    holder, key = random.choice(places)
    other, name = random.choice(places)
    match random.randrange(6):
        case 0:
            del holder[key]
        case 1 if isinstance(holder, dict):
            holder[random.choice((f"{key}x", "files", "choices", 3))] = holder.pop(key)
        case 2:
            holder[key] = copy.deepcopy(other[name]) if _there(other, name) else None
        case 3:
            numbers = [place for place in places if isinstance(place[0][place[1]], int | float)]
            for holder, key in random.sample(numbers, min(len(numbers), 3)):
                holder[key] = -holder[key]
        case 4 if isinstance(holder, dict) and isinstance(other, dict) and holder is not other:
            other[key] = holder.pop(key)  # which may stand in itself then
            if _holds(other[key], other):
                other.pop(key)
        case _:
            holder[key] = random.choice(VALUES)
    return write(top)


def _holds(value: Any, holder: Any) -> bool:
    inner = (h[k] for h, k in _places(value)) if isinstance(value, dict | list) else ()
    return value is holder or any(v is holder for v in inner)


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
        return in_letters(random, text)
    elements = list(root.iter())
    parents = {child: parent for parent in elements for child in parent}
    one, other = random.choice(elements), random.choice(elements)
    ranges = [e for e in elements if e.get("name", "").startswith(("min_", "range_", "rotation_"))]
    if ranges and random.random() < 0.3:
        tag = random.choice(ranges)
        random.choice((_negative, _misplaced, _renamed))(random, tag, parents[tag], elements)
        return ElementTree.tostring(root)
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


def _negative(
    random: Random, tag: ElementTree.Element, _: ElementTree.Element, __: list[ElementTree.Element]
) -> None:
    """One of the tag's numbers, `value` or x, y, z."""
    name = random.choice([name for name in tag.attrib if name != "name"] or ["value"])
    parts = tag.get(name, "1").split(",")
    at = random.randrange(len(parts))
    parts[at] = f"-{parts[at].strip()}"
    tag.set(name, ", ".join(parts))


def _misplaced(
    random: Random,
    tag: ElementTree.Element,
    parent: ElementTree.Element,
    elements: list[ElementTree.Element],
) -> None:
    """In another element, or in itself where that is the one."""
    parent.remove(tag)
    random.choice([e for e in elements if e is not tag]).append(tag)


def _renamed(
    random: Random, tag: ElementTree.Element, _: ElementTree.Element, __: list[ElementTree.Element]
) -> None:
    names = ("max_bounds", "min_bound", "range_bounds", "speed", "var_axis", "min_angle", "")
    tag.set("name", random.choice(names))
