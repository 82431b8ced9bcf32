"""What is wrong with a scene that loads: cameras in geometry or without direction, a small box."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import dr, mi
from ngi.scene.arrangement import STATIC
from ngi.scene.description import SceneDescription
from ngi.scene.jit_variables import aligned
from ngi.scene.kinds import CameraPath, LookAt
from ngi.scene.variable_scene import VariableScene

Points = NDArray[np.float64]
Hits = tuple[NDArray[np.bool_], NDArray[np.bool_], Points]
Intersect = Callable[[Points, Points], Hits]

CONFIGURATIONS = 24
"""Values of v at which the camera's places are tried; the first two are all 0 and all 1."""

SEGMENTS, DIRECTIONS = 400, 128

NEAREST = 0.002
"""How near a surface may be, as a share of the diagonal of the scene's box."""


def camera_problems(scene: VariableScene) -> list[str]:
    """What is wrong with the places the camera can take; empty where nothing is.

    The camera's box (or path) is crossed by segments of line between places in it: one that meets
    a surface shows that geometry reaches into the box. From some of the places rays go out in all
    directions, for surfaces that are too near and for objects that enclose the camera. Everything
    else that varies takes random values meanwhile.
    """
    generator = np.random.default_rng(1)
    size = float(np.linalg.norm(np.subtract(*scene.description.bounds)))
    intersect = _intersections(scene.scene)
    problems: list[str] = []
    for index, v in enumerate(_configurations(scene.description, CONFIGURATIONS)):
        scene.apply(v)
        place = np.array(mi.traverse(scene.scene.sensors()[0])["to_world"].matrix, dtype=float)
        found = _blocked(scene, intersect, generator)
        found = found or _too_near(place.reshape(4, 4)[:3, 3], intersect, size, generator)
        if found:
            which = v.round(3).tolist() if len(v) < 16 else f"number {index}"
            problems.append(f"at v = {which}: {found}")
    return problems


def _blocked(
    scene: VariableScene, intersect: Intersect, generator: np.random.Generator
) -> str | None:
    for variable in scene.description.variables:
        if isinstance(variable, CameraPath):
            steps = np.linspace(0, 1, SEGMENTS + 1)[:, None]
            path = np.array([variable.value(step)[:3] for step in steps])
            start, end = path[:-1], path[1:]
        elif isinstance(variable, LookAt):
            components = generator.random((2 * SEGMENTS, len(variable.components)))
            places = np.array([variable.value(each)[:3] for each in components])
            start, end = places[:SEGMENTS], places[SEGMENTS:]
        else:
            continue
        length = np.maximum(np.linalg.norm(end - start, axis=1), 1e-12)
        hit, _, distance = intersect(start, (end - start) / length[:, None])
        if (inside := hit & (distance < length)).any():
            first = int(np.argmax(inside))
            place = start[first] + (end - start)[first] * distance[first] / length[first]
            where = place.round(3).tolist()
            return f"geometry reaches into the camera's range, for example at {where}"
    return None


def _too_near(
    place: Points, intersect: Intersect, size: float, generator: np.random.Generator
) -> str | None:
    directions = generator.normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hit, behind, distance = intersect(np.tile(place, (DIRECTIONS, 1)), directions)
    nearest = distance[hit].min(initial=np.inf)
    if nearest < NEAREST * size:
        return f"the camera at {place.round(3).tolist()} is only {nearest:.3g} from a surface"
    if hit.all() and behind.all() and distance.max() < size / 4:
        return f"the camera at {place.round(3).tolist()} is inside an object"
    return None


def _intersections(scene: mi.Scene) -> Intersect:
    """A function of n rays: whether they hit, whether from behind, and the distance."""
    if mi.variant().startswith("scalar"):
        return partial(_intersect_one_by_one, scene)

    @dr.freeze  # type: ignore[untyped-decorator]
    def trace(scene: mi.Scene, rays: mi.Ray3f) -> tuple[mi.Bool, mi.Float, mi.Float]:
        hit = scene.ray_intersect(rays)
        return hit.is_valid(), dr.dot(hit.n, rays.d), hit.t

    def intersect(origins: Points, directions: Points) -> Hits:
        ends = [[aligned(axis, np.float32) for axis in side.T] for side in (origins, directions)]
        rays = mi.Ray3f(mi.Point3f(*ends[0]), mi.Vector3f(*ends[1]))
        dr.make_opaque(rays)
        valid, cosine, distance = trace(scene, rays)
        return np.array(valid), np.array(cosine) > 0, np.array(distance, dtype=np.float64)

    return intersect


def _intersect_one_by_one(scene: mi.Scene, origins: Points, directions: Points) -> Hits:
    hits = [
        scene.ray_intersect(mi.Ray3f(mi.Point3f(*o), mi.Vector3f(*d)))
        for o, d in zip(origins.tolist(), directions.tolist(), strict=True)
    ]
    valid = np.array([bool(hit.is_valid()) for hit in hits])
    cosine = np.array([np.dot(hit.n, d) for hit, d in zip(hits, directions, strict=True)])
    return valid, cosine > 0, np.array([float(hit.t) for hit in hits])


MEASURED = 8
"""Values of v at which shapes are measured; the first two are all 0 and all 1."""

TOLERANCE = 0.001
"""How far a shape may reach out, as a share of the diagonal of the box."""

NEARLY = 1e-9
"""How near two points may come to have no direction between them, see `transforms.look_at`."""


def out_of_bounds(scene: VariableScene) -> list[str]:
    """A line for every shape that somewhere reaches out of the box `bounds`.

    No error: the box has to hold what the camera can see, and a wall has a far side.
    """
    low, high = np.array(scene.description.bounds)
    farthest: dict[str, float] = {}
    for v in _configurations(scene.description, MEASURED):
        scene.apply(v)
        hidden = scene.description.hidden(v)
        for shape, instance in scene.placed():
            name = shape.id() if instance is None or instance.id() == STATIC else instance.id()
            if not {name, shape.id()} & set(hidden):
                points = _outline(shape, instance)
                out = float(np.maximum(low - points, points - high).max())
                farthest[name] = max(farthest.get(name, 0.0), out)
    size = float(np.linalg.norm(high - low))
    return [
        f"'{name}' reaches {far:.3g} out of bounds; if the camera can see that part, widen bounds"
        for name, far in sorted(farthest.items(), key=lambda item: -item[1])
        if far > TOLERANCE * size
    ]


def _outline(shape: mi.Shape, instance: mi.Shape | None) -> Points:
    """[n, 3]: points that a shape does not reach beyond, where its instance has put it.

    The vertices of a mesh in an instance, which may turn, else the corners of the shape's box.
    """
    parameters = mi.traverse(shape)
    if instance is not None and "vertex_positions" in parameters:  # a rectangle, a mesh, has none
        points = np.array(parameters["vertex_positions"], np.float64).reshape(-1, 3)
    else:
        box = shape.bbox()
        points = np.array(list(product(*zip(np.ravel(box.min), np.ravel(box.max), strict=True))))
    if instance is None:
        return points
    matrix = np.array(mi.traverse(instance)["to_world"].matrix, np.float64).reshape(4, 4)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def meeting_views(description: SceneDescription) -> list[str]:
    """A line for every look_at whose origin and target can be the same point."""
    return [
        f"{'+'.join(variable.objects)}.look_at: origin and target can meet, for example at "
        f"{place.round(3).tolist()}, which leaves no viewing direction; keep their ranges apart "
        "along one axis"
        for variable in description.variables
        if isinstance(variable, LookAt) and (place := _meeting(variable)) is not None
    ]


def _meeting(variable: LookAt) -> np.ndarray | None:
    """[3]: a point that can be origin and target at once, if there is one."""
    low, high = np.array([variable.minimum, variable.maximum]).reshape(2, 2, 3)
    if variable.linked:  # where along the way of both the two are nearest
        start, change = low[1] - low[0], (high - low)[1] - (high - low)[0]
        u = np.clip(-start @ change / max(change @ change, 1e-300), 0, 1)
        origin, target = low + u * (high - low)
        return origin if np.linalg.norm(target - origin) < NEARLY else None
    ranges = np.stack([np.minimum(low, high), np.maximum(low, high)])
    inner, outer = ranges[0].max(axis=0), ranges[1].min(axis=0)
    return inner if (inner <= outer).all() else None


def _configurations(description: SceneDescription, count: int) -> Iterator[np.ndarray]:
    """Always the same [D]; materials, which are in nobody's way and slow to exchange, stay."""
    generator = np.random.default_rng(0)
    for index in range(count):
        v = generator.random(description.dimensions)
        v = np.full_like(v, index) if index < 2 else v
        yield description.with_first_materials(v)
