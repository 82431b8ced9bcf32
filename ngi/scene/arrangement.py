"""Arranges a scene's shapes so that moving one of them costs as little as possible.

When a shape moves, Embree builds the structure over everything at the top level again, at its
highest quality; groups are left alone (see `ngi.scene.acceleration`). In a scene of large meshes,
what never moves is therefore put behind one instance. In a scene of small ones, the detour of every
ray through the instance would cost more than it saves. A mesh that moves as a whole becomes an
instance, so that its vertices are never rewritten.
"""

from collections.abc import Sequence
from contextlib import suppress
from xml.etree import ElementTree

import numpy as np

from ngi.scene.assets import to_world
from ngi.scene.kinds import KeyFrames, Rotation, Scale, Shape, Translation, Visibility
from ngi.scene.parameters import MESH_BEHIND
from ngi.scene.scene_files import SceneFile
from ngi.scene.variable import Variable

STATIC = "ngi_static"
"""The id of the instance of what stays."""

_PLACED = ("instance", "shapegroup", "sphere", "rectangle", "disk", "cylinder")
"""Shapes that have a to_world, and groups."""

_CARRIED = ("emitter", "sensor")
"""What Mitsuba does not allow in groups."""


WORTHWHILE = 100_000
"""Bytes of meshes that stay from which on they are put behind an instance."""


def arranged(
    document: SceneFile, variables: Sequence[Variable], *, worthwhile: int = WORTHWHILE
) -> SceneFile:
    """The same scene, arranged for these variables; as it is where no shape moves. Needs an active
    variant of Mitsuba.

    What carries an emitter or a sensor stays where it is: Mitsuba does not allow it in groups. Ids
    are kept; that of a mesh that became an instance is the instance's.
    """
    moved = moving(variables)
    copied = document.copied()
    root = copied.root
    shapes = root.findall("shape")
    if not moved & {shape.get("id") for shape in shapes}:
        return document
    reshaped = {name for v in variables if isinstance(v, KeyFrames) for name in v.objects}
    carried = {each.get("id") for tag in _CARRIED for each in root.findall(tag)}
    static: list[ElementTree.Element] = []
    for shape in shapes:
        name, kind = shape.get("id"), shape.get("type")
        if _carries(shape, carried) or kind in ("instance", "shapegroup") or name in reshaped:
            continue
        if name not in moved:
            static.append(shape)
        elif kind not in _PLACED:
            root.remove(shape)
            shape.set("id", MESH_BEHIND.format(name))
            group = ElementTree.SubElement(root, "shape", type="shapegroup", id=f"ngi_{name}")
            group.append(shape)
            instance = _add_instance(root, str(name), of=group)
            _hand_over_place(document, shape=shape, instance=instance)
    if static and sum(_mesh_size(document, shape) for shape in static) >= worthwhile:
        group = ElementTree.SubElement(root, "shape", type="shapegroup", id="ngi_static_group")
        for shape in static:
            root.remove(shape)
            group.append(shape)
        _add_instance(root, STATIC, of=group)
    return copied


def _hand_over_place(
    document: SceneFile, *, shape: ElementTree.Element, instance: ElementTree.Element
) -> None:
    """Makes a shape's to_world the instance's, so that this has its origin.

    Of one that scales or mirrors only the origin: an instance would scale the radii of curves too,
    keeps the smooth normals that Mitsuba makes up before a mesh is stretched, and does not turn a
    mirrored mesh inside out. What Mitsuba does not read is for `load` to tell.
    """
    transforms, matrix = shape.findall("transform"), np.eye(4)
    with suppress(RuntimeError):
        matrix = to_world(document, shape)
    linear = matrix[:3, :3]
    if np.linalg.det(linear) < 0 or not np.allclose(linear.T @ linear, np.eye(3), atol=1e-5):
        (own,) = transforms
        handed = ElementTree.Element("transform", dict(own.attrib))
        for transform, sign in ((own, -1), (handed, 1)):
            place = dict(zip("xyz", map(repr, (sign * matrix[:3, 3]).tolist()), strict=True))
            ElementTree.SubElement(transform, "translate", place)
        instance.append(handed)
        return
    for transform in transforms:
        shape.remove(transform)
        instance.append(transform)


def moving(variables: Sequence[Variable]) -> set[str]:
    """Ids of what variables place, show, hide or reshape."""
    moved: set[str] = set()
    for variable in variables:
        if isinstance(variable, Translation | Rotation | Scale | Visibility | KeyFrames):
            moved.update(variable.objects)
        elif isinstance(variable, Shape):
            moved.update(variable.choices)
    return moved


def turning(variables: Sequence[Variable]) -> set[str]:
    """Ids of what variables turn or scale."""
    return {name for v in variables if isinstance(v, Rotation | Scale) for name in v.objects}


def _mesh_size(document: SceneFile, shape: ElementTree.Element) -> int:
    """Bytes of the shape's file, 0 where it has none."""
    name = shape.find("string[@name='filename']")
    path = document.path.parent / (name.get("value", "") if name is not None else "")
    return path.stat().st_size if path.is_file() else 0


def _carries(shape: ElementTree.Element, ids: set[str | None]) -> bool:
    """Whether an emitter or a sensor is part of it. ids: of those that stand elsewhere."""
    references = {ref.get("id") for ref in shape.findall("ref")}
    return any(shape.find(tag) is not None for tag in _CARRIED) or bool(references & ids)


def _add_instance(
    root: ElementTree.Element, name: str, *, of: ElementTree.Element
) -> ElementTree.Element:
    instance = ElementTree.SubElement(root, "shape", type="instance", id=name)
    ElementTree.SubElement(instance, "ref", id=str(of.get("id")))
    return instance
