"""Loads a Mitsuba scene from its XML, wherever that came from."""

from __future__ import annotations

import re
from bisect import bisect_right
from xml.etree import ElementTree

from ngi.backend import mi
from ngi.scene.scene_files import SceneFile, file_references
from ngi.scene.xml_file import shown

FROM_FILES = ("bitmap", "envmap", "gridvolume", "obj", "ply", "serialized")
"""Plugins that are nothing without a file; Mitsuba 3.9 crashes on a bitmap without."""

_PLACE = re.compile(r"^.*?\(line (?P<line>\d+), col \d+\): ", re.DOTALL)
"""Of Mitsuba's messages about XML."""


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
            place = f"<{element.tag} type='{element.get('type')}'>"
            raise ValueError(
                f"{document.path}: {place} names no file; give it <string name='filename' …/>"
            )
    ElementTree.indent(absolute, space="")  # a tag per line, by which Mitsuba's place is known
    text = ElementTree.tostring(absolute, encoding="unicode")
    try:
        return mi.load_string(text, optimize=False)
    except RuntimeError as error:
        raise ValueError(_in_words(str(error), text, copied)) from error


def _in_words(message: str, text: str, document: SceneFile) -> str:
    """Mitsuba's message about `text`, with the place in the file that the user wrote."""
    match = _PLACE.search(message)
    if match is None:
        return f"{document.path}: Mitsuba cannot load it: {message}"
    starts = [n for n, line in enumerate(text.splitlines(), 1) if not line.startswith("</")]
    elements = list(document.root.iter())
    element = elements[bisect_right(starts, int(match["line"])) - 1]
    around = {child: parent for parent in elements for child in parent}
    written = element
    while written not in document.places and written in around:
        written = around[written]  # what this program has added stands in what the user wrote
    place = document.places.get(written, str(document.path))
    return f"{place}: {shown(element)}: {message[match.end() :]}"
