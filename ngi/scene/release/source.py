"""The XML of a tagged scene file, which remembers the line of every element."""

import re
from dataclasses import dataclass
from logging import getLogger
from math import isfinite
from pathlib import Path
from xml.etree.ElementTree import Element

from ngi.scene.scene_files import SceneFile, check_files, element_places
from ngi.scene.xml_file import Lines, named, parents_in, read_xml
from ngi.scene.yaml_keys import Vector

_logger = getLogger(__name__)


@dataclass(frozen=True)
class Source:
    """A parsed file; `document` is what becomes of it.

    lines: where each element begins. parents: what each stood in, in the file.
    """

    document: SceneFile
    lines: Lines
    parents: dict[Element, Element]

    @property
    def root(self) -> Element:
        return self.document.root

    def place(self, element: Element) -> str:
        """File and line; the file alone for an element that was added."""
        return self.document.places.get(element, str(self.document.path))

    def note_copy(self, element: Element, new: Element) -> None:
        """Says that an element and all in it have the lines of those that they were copied from."""
        places = self.document.places
        pairs = zip(element.iter(), new.iter(), strict=True)
        places.update({copied: places[old] for old, copied in pairs if old in places})

    def error(self, element: Element, message: str) -> ValueError:
        """A ValueError that names the file, the line and the element."""
        return ValueError(f"{self.place(element)}: {named(element, self.parents)}: {message}")

    def warn(self, element: Element, message: str) -> None:
        """Says something that names the file, the line and the element."""
        _logger.warning("%s: %s: %s", self.place(element), named(element, self.parents), message)

    def numbers(self, element: Element, attribute: str = "value") -> Vector:
        """The numbers of an attribute, with commas or spaces between them."""
        text = element.get(attribute, "")
        try:
            values = tuple(float(part) for part in re.split(r"[\s,]+", text.strip()))
        except ValueError:
            values = ()
        if not values or not all(map(isfinite, values)):
            raise self.error(element, f"{attribute} is '{text}'; expected numbers")
        return values

    def vector(self, element: Element, default: float = 0.0) -> Vector:
        """[3]: from value='x, y, z', one number for all three, or attributes x, y and z."""
        if "value" not in element.attrib:
            axes = [name for name in "xyz" if name in element.attrib]
            given = {name: self.number(element, name) for name in axes}
            return tuple(given.get(name, default) for name in "xyz")
        values = self.numbers(element)
        if len(values) not in (1, 3):
            raise self.error(element, f"{len(values)} numbers instead of 3")
        return values * 3 if len(values) == 1 else values

    def number(self, element: Element, attribute: str = "value") -> float:
        values = self.numbers(element, attribute)
        if len(values) != 1:
            raise self.error(element, f"{attribute} holds {len(values)} numbers instead of one")
        return values[0]

    def integer(self, element: Element) -> int:
        value = self.number(element)
        if value % 1:
            raise self.error(element, f"value is {value:g}; expected an integer")
        return int(value)


def read_source(path: Path) -> Source:
    """Raises FileNotFoundError for files that are not there, and ValueError, with the line, for
    broken XML and for files that it must not read.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such scene file; give a scene's folder or file")
    root, lines = read_xml(path)
    document = SceneFile(path, root, places=element_places(path, lines))
    source = Source(document, lines, parents_in(root))
    _check(source)
    return source


def _check(source: Source) -> None:
    if source.root.tag != "scene":
        raise source.error(source.root, "the root of a scene file is <scene>")
    seen: dict[str, Element] = {}
    for element in source.root.iter():
        if element.tag == "include":
            raise source.error(element, "put the content of that file here; tags are read in one")
        if element.tag == "ref" or "id" not in element.attrib:
            continue
        if (name := element.attrib["id"]) in seen:
            first = source.lines[seen[name]]
            raise source.error(element, f"line {first} has this id already; make them two")
        seen[name] = element
    check_files(source.document, within=source.document.path.parent)
