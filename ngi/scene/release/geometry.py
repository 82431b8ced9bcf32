"""The box of a scene's geometry, read from its file and the meshes, without Mitsuba."""

from itertools import product
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ngi.scene import transforms
from ngi.scene.release.motion import Motion
from ngi.scene.release.source import Source
from ngi.scene.variable import Values
from ngi.scene.yaml_keys import Vector


def vertices(path: Path, kind: str) -> Values:
    """[n, 3], of a file of this kind ('ply' or 'obj'); those that no face has may be missing.

    Raises ValueError, with the file's name, for one that cannot be read.
    """
    import trimesh  # takes half a second, and only the authors' files need it

    with path.open("rb") as file:  # without a name: what the file refers to is not looked for
        try:
            mesh = trimesh.load_mesh(file, file_type=kind, process=False)
            found: Values = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        except Exception as error:  # of nearly any class, as the file is damaged
            raise ValueError(
                f"{path}: cannot be read as {kind.upper()}: {type(error).__name__}: {error}"
            ) from error
    if not len(found):
        raise ValueError(f"{path}: no face has a vertex")
    return found


Box = tuple[Values, Values]

FARTHEST = 1e15
"""Squares of more do not fit into single precision together."""

_CIRCLE = np.array([[np.cos(a), np.sin(a), 0] for a in np.linspace(0, 2 * np.pi, 64)])
_SQUARE = np.array([[x, y, 0.0] for x, y in product((-1, 1), repeat=2)])
_CUBE = np.array(list(product((-1.0, 1.0), repeat=3)))


def scene_box(source: Source, motions: dict[Element, Motion]) -> Box:
    """Minimum and maximum corner of all shapes, over the range of their motions.

    A scene that is flat along an axis gets a box that is not, by a thousandth of its size.
    """
    shapes = [e for e in source.root.findall("shape") if e.get("type") != "shapegroup"]
    corners = [_corners(source, shape, motions.get(shape)) for shape in shapes]
    corners = [points for points in corners if len(points)]
    if not corners:
        raise source.error(source.root, "no shape, so that there is nothing to see")
    points = np.concatenate(corners)
    return transforms.thickened(points.min(axis=0), points.max(axis=0))


def _corners(source: Source, shape: Element, motion: Motion | None) -> Values:
    """[n, 3]: the corners of a shape's boxes at all the places it may stand."""
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            corners = _box_corners(_points(source, shape))
            corners = corners if motion is None or not len(corners) else motion.sweep(corners)
    except FloatingPointError as error:
        message = f"where it stands cannot be computed ({error}); correct its numbers"
        raise source.error(shape, message) from None
    if not (np.abs(corners) < FARTHEST).all():
        message = f"it reaches farther than {FARTHEST:g} from the origin; correct its numbers"
        raise source.error(shape, message)
    return corners


def _points(source: Source, shape: Element) -> Values:
    """[n, 3] in world space, whose box is the shape's."""
    if shape.get("type") == "instance":
        members = group_of(source, shape).findall("shape")
        for member in members:
            if member.get("type") == "instance":
                raise source.error(member, "an instance cannot be part of a shapegroup")
        points = np.concatenate([np.zeros((0, 3)), *(_points(source, m) for m in members)])
        points = _box_corners(points)
    else:
        points = _own_points(source, shape)
    matrix = to_world(source, shape)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _own_points(source: Source, shape: Element) -> Values:
    kind = shape.get("type")
    match kind:
        case "ply" | "obj":
            return vertices(_file(source, shape), kind)
        case "rectangle":
            return _SQUARE
        case "cube":
            return _CUBE
        case "disk":
            return _CIRCLE
        case "sphere":
            centre, radius = _child(source, shape, "center", 0.0), _radius(source, shape)
            return np.array(centre) + radius * _sphere_points(to_world(source, shape))
        case "cylinder":
            ends = [_child(source, shape, name, z) for name, z in (("p0", 0.0), ("p1", 1.0))]
            around = _radius(source, shape) * _sphere_points(to_world(source, shape))
            return np.concatenate([np.array(end) + around for end in ends])
    known = "ply, obj, rectangle, cube, disk, sphere, cylinder"
    raise source.error(shape, f"the box of a '{kind}' is not known, only of {known} and instances")


def _sphere_points(matrix: Values) -> Values:
    """The points of the unit sphere that a matrix takes farthest along each axis."""
    rows = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=1, keepdims=True)
    return np.concatenate([rows, -rows])


def group_of(source: Source, instance: Element) -> Element:
    """The shapegroup of an instance."""
    groups = {e.get("id"): e for e in source.root.findall("shape[@type='shapegroup']")}
    names = [ref.get("id") for ref in instance.findall("ref")]
    if len(names) != 1 or names[0] not in groups:
        raise source.error(instance, f"expected one <ref> to a shapegroup, got {names}")
    return groups[names[0]]


def to_world(source: Source, element: Element) -> Values:
    """[4, 4]: the steps of <transform name="to_world">, the first one rightmost."""
    matrix = np.eye(4)
    for step in element.findall("transform[@name='to_world']/*"):
        matrix = _step(source, step) @ matrix
    return matrix


def _step(source: Source, step: Element) -> Values:
    match step.tag:
        case "translate":
            return transforms.translation(np.array(source.vector(step)))
        case "scale":
            return np.diag([*source.vector(step, default=1.0), 1.0])
        case "rotate":
            axis = source.vector(step)
            return transforms.rotation(np.array(axis), source.number(step, "angle"))
        case "lookat":
            views = [np.array(source.numbers(step, name)) for name in ("origin", "target", "up")]
            return transforms.look_at(*views)
        case "matrix":
            values = np.array(source.numbers(step))
            if values.size in (9, 16):
                matrix = np.eye(4)
                side = int(values.size**0.5)
                matrix[:side, :side] = values.reshape(side, side)
                return matrix
    known = "translate, scale, rotate, lookat, matrix of 9 or 16 numbers"
    raise source.error(step, f"unknown step of a transform; known: {known}")


def _box_corners(points: Values) -> Values:
    if not len(points):
        return points
    low, high = points.min(axis=0), points.max(axis=0)
    corners: Values = np.where(_CUBE > 0, high, low)
    return corners


def _file(source: Source, shape: Element) -> Path:
    name = shape.find("string[@name='filename']")
    if name is None:
        raise source.error(shape, "names no file; give <string name='filename' value='...'/>")
    return source.document.path.parent / name.get("value", "")


def _child(source: Source, shape: Element, name: str, z: float) -> Vector:
    child = shape.find(f"*[@name='{name}']")
    return (0.0, 0.0, z) if child is None else source.vector(child)


def _radius(source: Source, shape: Element) -> float:
    child = shape.find("float[@name='radius']")
    return 1.0 if child is None else source.number(child)
