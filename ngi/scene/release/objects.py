"""A document while it is rewritten: its ids, and which objects each of them has become."""

from __future__ import annotations

import copy
from itertools import chain, count
from xml.etree.ElementTree import Element

from ngi.scene.release.geometry import group_of
from ngi.scene.release.source import Source


class Objects:
    """Ids of a document. An element that is copied gets new ones, which are remembered.

    Every instance has an id.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.root = source.root
        objects = [e for e in self.root.iter() if e.tag != "ref"]
        self._used = {e.attrib["id"] for e in objects if "id" in e.attrib}
        self._became: dict[str, list[str]] = {}
        for instance in self.shapes("instance"):
            self.id_of(instance, like="instance")

    def shapes(self, kind: str) -> list[Element]:
        """The shapes of a type that are directly in the scene."""
        return [shape for shape in self.root.findall("shape") if shape.get("type") == kind]

    def instances(self, group: Element) -> list[Element]:
        return [e for e in self.shapes("instance") if group_of(self.source, e) is group]

    def by_id(self, object_id: str) -> Element:
        """Raises ValueError for an id that no object has."""
        for element in self.root.iter():
            if element.tag != "ref" and element.get("id") == object_id:
                return element
        raise ValueError(f"{self.source.document.path}: no object has the id '{object_id}'")

    def new_id(self, like: str) -> str:
        """An id that no object has yet: the one asked for, or with a number behind it."""
        numbered = chain([like], (f"{like}_{number}" for number in count(2)))
        name = next(name for name in numbered if name not in self._used)
        self._used.add(name)
        return name

    def id_of(self, element: Element, *, like: str) -> str:
        """The element's id. An element without an id gets a new one, similar to `like`."""
        if "id" not in element.attrib:
            element.set("id", self.new_id(like))
        return element.attrib["id"]

    def copy(self, element: Element) -> Element:
        """A copy of an element, with new ids. Messages name the lines of the original."""
        new = copy.deepcopy(element)
        self.source.note_copy(element, new)
        for child in new.iter():
            if child.tag != "ref" and "id" in child.attrib:
                old = child.attrib["id"]
                child.set("id", self.new_id(old))
                self._became.setdefault(old, [old]).append(child.attrib["id"])
        return new

    def replace(self, object_id: str, ids: list[str]) -> None:
        """Says that these objects stand for another one, which may be one of them."""
        self._became[object_id] = ids

    def ids(self, object_id: str) -> tuple[str, ...]:
        """All objects that stand for one of the file, itself included if it is still there."""
        became = self._became.get(object_id, [object_id])
        below = [(name,) if name == object_id else self.ids(name) for name in became]
        return tuple(chain.from_iterable(below))


def insert_after(root: Element, element: Element, new: list[Element]) -> None:
    """Puts elements behind another one of the root's."""
    index = list(root).index(element) + 1
    root[index:index] = new
