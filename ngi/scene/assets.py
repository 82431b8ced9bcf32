"""Images and meshes that variables swap in, loaded as those that scene.xml names."""

import copy
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ngi.machine.backend import a_worker_thread, mi
from ngi.scene import srgb
from ngi.scene.loading import without_place
from ngi.scene.parameters import Parameters
from ngi.scene.scene_files import SceneFile
from ngi.scene.variable import Values

_GEOMETRY = ("string", "boolean", "transform")


class Bitmap:
    """The `ngi.scene.variable.Bitmap` of a bitmap texture's data.

    Mitsuba keeps an 8-bit file as the 8-bit numbers that it holds, in sRGB unless the texture is
    `raw`; others, and all where the texture says so (`format`), as linear floating-point numbers.
    """

    def __init__(self, parameters: Parameters, key: str) -> None:
        texture, data = parameters.owner(key), parameters.value(key)
        self._kind = type(data)
        self._raw = "raw = 1" in str(texture)  # the texture has no attribute that says it
        self.shape: tuple[int, ...] = parameters.read(key).shape

    def load(self, path: Path) -> Values:
        """The numbers of a file; ValueError where it is of another size or kind."""
        bits = {"TensorXu8": "auto", "TensorXf16": "fp16"}.get(self._kind.__name__, "variant")
        options = {"raw": self._raw, "format": bits}
        with a_worker_thread():
            texture = mi.load_dict({"type": "bitmap", "filename": str(path), **options})
        data = mi.traverse(texture)["data"]
        if type(data) is not self._kind or np.shape(data) != self.shape:
            raise ValueError(
                f"{path}: an image of {_size(np.shape(data), type(data))}, but the bitmap of "
                f"scene.xml has {_size(self.shape, self._kind)}; make them equal"
            )
        return np.array(data, dtype=np.float64)

    def stored(self, linear: Values) -> Values:
        """What stands for linear numbers in [0, 1]; of 8 bits, to the nearest."""
        if self._kind.__name__ != "TensorXu8":
            return linear
        if not self._raw:
            linear = srgb.encoded(linear)
        return np.round(255 * linear)


def authored_to_world(document: SceneFile, object_id: str) -> Values:
    """[4, 4]: of a shape that does not show it once loaded, such as a mesh."""
    return to_world(document, _shape(document, object_id))


def to_world(document: SceneFile, shape: ElementTree.Element) -> Values:
    """[4, 4]: of an element of a document. RuntimeError, as Mitsuba words it, for mistakes."""
    rectangle = ElementTree.Element("shape", type="rectangle")
    rectangle.extend(shape.findall("transform"))
    matrix = mi.traverse(_loaded(document, rectangle))["to_world"].matrix
    return np.array(matrix, dtype=np.float64).reshape(4, 4)


def load_vertices(document: SceneFile, object_id: str, path: Path) -> tuple[Values, Values | None]:
    """World-space positions [n, 3] and normals [n, 3] that a mesh would have with another file.

    No normals where the mesh is without. Raises ValueError for a file of another topology.
    """
    authored = copy.deepcopy(_shape(document, object_id))
    for child in list(authored):
        if child.tag not in _GEOMETRY:
            authored.remove(child)
    name = authored.find("string[@name='filename']")
    if name is None:
        raise ValueError(f"{document.path}: '{object_id}' is not a mesh that comes from a file")
    name.set("value", str(document.path.parent.resolve() / name.get("value", "")))
    present = mi.traverse(_loaded(document, authored))
    name.set("value", str(path))
    try:
        other = mi.traverse(_loaded(document, authored))
    except RuntimeError as error:
        raise ValueError(f"{path}: Mitsuba cannot load it: {without_place(str(error))}") from error
    if not np.array_equal(present["faces"], other["faces"]):
        raise ValueError(
            f"{path}: its triangles are not those of the mesh '{object_id}' in scene.xml; key "
            "frames need the same vertices and triangles in the same order"
        )
    positions, normals = (
        np.array(other[key], dtype=np.float64).reshape(-1, 3)
        for key in ("vertex_positions", "vertex_normals")
    )
    return positions, normals if len(normals) else None


def _shape(document: SceneFile, object_id: str) -> ElementTree.Element:
    shape = next((s for s in document.root.iter("shape") if s.get("id") == object_id), None)
    if shape is None:
        raise ValueError(
            f"{document.path}: no <shape id='{object_id}'> in the file itself; bring it there from "
            "the one that is included"
        )
    return shape


def _loaded(document: SceneFile, element: ElementTree.Element) -> mi.Object:
    alone = copy.deepcopy(element)
    alone.set("version", document.root.get("version", "3.0.0"))
    with a_worker_thread():
        return mi.load_string(ElementTree.tostring(alone, encoding="unicode"), optimize=False)


def _size(shape: tuple[int, ...], kind: type) -> str:
    bits = {"TensorXu8": "8-bit", "TensorXf16": "16-bit"}.get(kind.__name__, "32-bit")
    return f"{shape[1]} x {shape[0]} pixels and {shape[2]} {bits} channel(s)"
