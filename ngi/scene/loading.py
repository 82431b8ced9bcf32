"""Loads a Mitsuba scene from its XML, wherever that came from."""

from __future__ import annotations

import copy
from xml.etree import ElementTree

from ngi.backend import mi
from ngi.scene.scene_files import SceneFile, file_references


def load(document: SceneFile) -> mi.Scene:
    """The scene of a stock Mitsuba 3 document, whose files are named from its folder."""
    folder = document.path.parent.resolve()
    absolute = SceneFile(document.path, copy.deepcopy(document.root), document.defaults)
    for _, element, attribute in file_references(absolute):
        element.set(attribute, str(folder / absolute.value(element, attribute)))
    # Optimising would merge meshes that share a BSDF, and their ids would be lost.
    return mi.load_string(ElementTree.tostring(absolute.root, encoding="unicode"), optimize=False)
