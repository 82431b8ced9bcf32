"""Reads XML that anybody may have written, with the $names in it replaced."""

import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

MOST_LEVELS = 64
MOST_CHARACTERS = 100_000
"""Of an attribute, once the $names in it are replaced by text that may hold others."""

Lines = dict[Element, int]
"""Where each element begins."""


def read_xml(path: Path) -> tuple[Element, Lines]:
    """As `parse_xml`; every <default> is taken out, and its $name replaced in all attributes."""
    root, lines = parse_xml(path)
    defaults: dict[str, str] = {}
    for element in root.iter():
        replace_names(element, defaults, place=f"{path}, line {lines[element]}")
    remove_defaults(root)
    return root, lines


def parse_xml(path: Path) -> tuple[Element, Lines]:
    """The root, and the line of every element; text between elements is left out.

    Raises ValueError, naming file and line, for broken XML, entities (a few lines of which can
    stand for gigabytes, or for another file), and elements nested without end; and OSError for a
    file that cannot be read.
    """
    builder, parser = TreeBuilder(), expat.ParserCreate()
    lines: Lines = {}
    depth = 0

    def error(message: str) -> ValueError:
        return ValueError(f"{path}, line {parser.CurrentLineNumber}: {message}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MOST_LEVELS:
            raise error(f"elements in more than {MOST_LEVELS} others; a scene is flatter")
        lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def entity(name: str, *_: object) -> None:
        raise error(f"declares the entity '{name}'; write its text where it is used")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as problem:
        raise ValueError(f"{path}: not well-formed XML: {problem}; correct it there") from None
    except LookupError as problem:
        raise ValueError(f"{path}: {problem}; save it as UTF-8") from None
    return builder.close(), lines


def replace_names(element: Element, defaults: dict[str, str], *, place: str) -> None:
    """Replaces the $names in an element's attributes; of a <default>, takes note of its own.

    Elements come in document order: a <default> may be made of those before it, which win.

    Raises ValueError for $names nested without end. place: file and line, for its message.
    """
    for attribute, text in element.items():
        if "$" not in text:
            continue
        names = "|".join(map(re.escape, sorted(defaults, key=len, reverse=True)))
        parts = re.split(rf"\$({names})", text) if names else [text]
        new = "".join(defaults[p] if i % 2 else p for i, p in enumerate(parts))
        if len(new) > MOST_CHARACTERS:
            raise ValueError(
                f"{place}: {attribute} of <{element.tag}> becomes {len(new)} characters; $names "
                f"may stand for {MOST_CHARACTERS}"
            )
        element.set(attribute, new)
    if element.tag == "default":
        defaults.setdefault(element.get("name", ""), element.get("value", ""))


def remove_defaults(root: Element) -> None:
    """Every <default>, which Mitsuba need not see once its name is replaced."""
    for parent in list(root.iter()):
        for default in parent.findall("default"):
            parent.remove(default)


def shown(element: Element) -> str:
    """The element as a message shows it, for example <shape type='ply' id='var_lamp'>."""
    names = ("type", "id", "name", "value")
    given = [f" {name}='{element.get(name)}'" for name in names if name in element.attrib]
    return f"<{element.tag}{''.join(given)}>"


def outwards(element: Element, parents: Mapping[Element, Element]) -> list[Element]:
    """The element, what it stands in, what that stands in, and so on."""
    found = [element]
    while found[-1] in parents:
        found.append(parents[found[-1]])
    return found


def named(element: Element, parents: Mapping[Element, Element]) -> str:
    """As `shown`, with what has an id around an element that has none."""
    holder = next((e for e in outwards(element, parents) if "id" in e.attrib), element)
    return shown(element) if holder is element else f"{shown(element)} in {shown(holder)}"


def parents_in(root: Element) -> dict[Element, Element]:
    """What each element stands in."""
    return {child: parent for parent in root.iter() for child in parent}
