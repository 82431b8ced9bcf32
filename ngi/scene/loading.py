"""Loads a Mitsuba scene from its XML, wherever that came from."""

from __future__ import annotations

import copy
from xml.etree import ElementTree

from ngi.backend import mi
from ngi.scene.scene_files import SceneFile, file_references

FROM_FILES = ("bitmap", "envmap", "gridvolume", "obj", "ply", "serialized")
"""Plugins that are nothing without a file; Mitsuba 3.9 crashes on a bitmap without."""


def load(document: SceneFile) -> mi.Scene:
    """The scene of a stock Mitsuba 3 document, whose files are named from its folder.

    Raises ValueError, naming the file, for what Mitsuba does not take.
    """
    folder = document.path.parent.resolve()
    absolute = copy.deepcopy(document.root)
    for _, element, attribute in file_references(absolute):
        element.set(attribute, str(folder / element.get(attribute, "")))
    # Optimising would merge meshes that share a BSDF, and their ids would be lost.
    for element in absolute.iter():
        if element.get("type") in FROM_FILES and element.find("string[@name='filename']") is None:
            place = f"<{element.tag} type='{element.get('type')}'>"
            raise ValueError(
                f"{document.path}: {place} names no file; give it <string name='filename' …/>"
            )
    text = ElementTree.tostring(absolute, encoding="unicode")
    try:
        return mi.load_string(text, optimize=False)
    except RuntimeError as error:
        raise ValueError(f"{document.path}: Mitsuba cannot load it: {error}") from error
