"""Loads a Mitsuba scene from its XML, wherever that came from."""

from __future__ import annotations

from xml.etree import ElementTree

from ngi.machine.backend import mi
from ngi.scene.complaints import in_words
from ngi.scene.scene_files import SceneFile, file_references
from ngi.scene.xml_file import named, parents_in

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
            raise ValueError(f"{place}: {name} names no file; give it <string name='filename' …/>")
    ElementTree.indent(absolute, space="")  # a tag per line, by which Mitsuba's place is known
    text = ElementTree.tostring(absolute, encoding="unicode")
    try:
        return mi.load_string(text, optimize=False)
    except RuntimeError as error:
        raise ValueError(in_words(str(error), text, copied)) from error
