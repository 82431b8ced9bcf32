"""Loads a Mitsuba scene from its XML, and says what is wrong in words about the user's file."""

from __future__ import annotations

import re
from bisect import bisect_right
from difflib import get_close_matches
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ngi.machine.backend import a_worker_thread, mi
from ngi.scene.scene_files import SceneFile, file_references
from ngi.scene.xml_file import named, outwards, parents_in

_HEAD = re.compile(r"^.*?\(line (?P<line>\d+), col \d+\): ", re.DOTALL)
"""Where Mitsuba's messages about XML begin: a place in the text that it was given."""

_ELSEWHERE = re.compile(r"string \(line (?P<line>\d+), col \d+\)")
"""Another place, inside a message."""

_UNKNOWN = re.compile(r'^  - [^"\n]+ "(?P<name>[^"\n]+)": ', re.MULTILINE)
"""A line per property that a plugin does not have."""

_UNRESOLVED = re.compile(r'unresolved reference to "(?P<name>[^"]*)"')


def without_place(message: str) -> str:
    """A message of Mitsuba's without the place that it begins with."""
    return _HEAD.sub("", message)


def in_words(message: str, text: str, document: SceneFile) -> str:
    """A message of Mitsuba's about `text`, with line and element of the file that the user wrote.

    text: the document, with a tag per line
    An element without an id is named together with its parent. An element that this program has
    added has no line of its own; the line of the nearest parent that the user wrote is given.
    """
    match = _HEAD.search(message)
    if match is None:
        return f"{document.path}: Mitsuba cannot load it: {message}"
    complaint = _Complaint(text, document)
    owner = complaint.element_at(int(match["line"]))
    element, what = complaint.pointed_out(owner, without_place(message))
    what = _ELSEWHERE.sub(lambda m: complaint.place(complaint.element_at(int(m["line"]))), what)
    return f"{complaint.place(element)}: {named(element, complaint.parents)}: {what}"


class _Complaint:
    """Elements of the document that a message is about."""

    def __init__(self, text: str, document: SceneFile) -> None:
        self._document = document
        self._elements = list(document.root.iter())
        self._starts = [n for n, line in enumerate(text.splitlines(), 1) if line[:2] != "</"]
        self.parents = parents_in(document.root)

    def element_at(self, line: int) -> Element:
        return self._elements[bisect_right(self._starts, line) - 1]

    def place(self, element: Element) -> str:
        places = self._document.places
        written = (e for e in outwards(element, self.parents) if e in places)
        return next(map(places.__getitem__, written), str(self._document.path))

    def pointed_out(self, element: Element, message: str) -> tuple[Element, str]:
        """What is wrong, and the element that is: Mitsuba may name the one that it stands in."""
        unknown = _UNKNOWN.findall(message)
        for child in element:
            if child.get("name") in unknown:
                kind = f"<{element.tag} type='{element.get('type')}'>"
                return child, f"a {kind} has no parameter of this name; correct or remove it"
        if (match := _UNRESOLVED.search(message)) is not None:
            for child in element.findall("ref"):
                if child.get("id") == match["name"]:
                    return child, f"no object has this id{self._near(match['name'])}"
        for sibling in self.parents.get(element, ()):
            if sibling is not element and sibling.get("name") == element.get("name", ""):
                twice = f"{self.place(sibling)} has the same name; remove one of them"
                return element, f"{message}; {twice}"
        return element, message

    def _near(self, name: str) -> str:
        known = [e.get("id", "") for e in self._elements if e.tag != "ref"]
        near = get_close_matches(name, filter(None, known), n=1)
        return f" (did you mean '{near[0]}'?)" if near else ""


FROM_FILES = ("bitmap", "envmap", "gridvolume", "obj", "ply", "serialized")
"""Plugins that are nothing without a file; Mitsuba 3.9 crashes on a bitmap without."""


def load(document: SceneFile) -> mi.Scene:
    """The scene of a stock Mitsuba 3 document, whose files are named from its folder.

    Raises ValueError, naming file, line and element, for what Mitsuba does not take.
    """
    folder = document.path.parent.resolve()
    copied = document.copied()
    absolute = copied.root
    for _, element, attribute in file_references(absolute):
        element.set(attribute, str(folder / element.get(attribute, "")))
    # Optimising would merge meshes that share a BSDF, and their ids would be lost.
    for element in absolute.iter():
        if element.get("type") in FROM_FILES and element.find("string[@name='filename']") is None:
            place = copied.places.get(element, document.path)
            name = named(element, parents_in(absolute))
            raise ValueError(f"{place}: {name} names no file; add <string name='filename' …/>")
    ElementTree.indent(absolute, space="")  # a tag per line, by which Mitsuba's place is known
    text = ElementTree.tostring(absolute, encoding="unicode")
    # Side by side, materials would get their numbers in another order each time, and those are
    # compiled into kernels, which the next process would not find again.
    try:
        with a_worker_thread():
            return mi.load_string(text, optimize=False, parallel=False)
    except RuntimeError as error:
        raise ValueError(in_words(str(error), text, copied)) from error
