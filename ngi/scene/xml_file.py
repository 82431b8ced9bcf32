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


def read_xml(path: Path, defaults: dict[str, str] | None = None) -> tuple[Element, Lines]:
    """The root, and the line of every element; text between elements is left out.

    Every <default> is taken out, and its $name replaced in all attributes. defaults: those of a
    file that includes this one, which win; this one's are added.

    Raises ValueError, naming file and line, for broken XML, entities (a few lines of which can
    stand for gigabytes, or for another file), and elements or $names nested without end; and
    OSError for a file that cannot be read.
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
    root = builder.close()
    _replace_names(path, root, lines, {} if defaults is None else defaults)
    return root, lines


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


def _replace_names(path: Path, root: Element, lines: Lines, defaults: dict[str, str]) -> None:
    """In document order: a <default> may be made of those before it."""
    for element in root.iter():
        for attribute, text in element.items():
            if "$" not in text:
                continue
            names = "|".join(map(re.escape, sorted(defaults, key=len, reverse=True)))
            parts = re.split(rf"\$({names})", text) if names else [text]
            new = "".join(defaults[p] if i % 2 else p for i, p in enumerate(parts))
            if len(new) > MOST_CHARACTERS:
                raise ValueError(
                    f"{path}, line {lines[element]}: {attribute} of <{element.tag}> becomes "
                    f"{len(new)} characters; $names may stand for {MOST_CHARACTERS}"
                )
            element.set(attribute, new)
        if element.tag == "default":
            defaults.setdefault(element.get("name", ""), element.get("value", ""))
    for parent in list(root.iter()):
        for default in parent.findall("default"):
            parent.remove(default)
