"""Whether the camera can get into geometry: every place that it can take must be in free air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ngi.backend import mi
from ngi.scene.kinds import CameraPath, LookAt
from ngi.scene.variable_scene import VariableScene

Points = NDArray[np.float64]

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
    generator = np.random.default_rng(0)
    size = float(np.linalg.norm(np.subtract(*scene.description.bounds)))
    problems: list[str] = []
    for index in range(CONFIGURATIONS):
        v = generator.random(scene.description.dimensions)
        v = np.full_like(v, index) if index < 2 else v
        scene.apply(v)
        found = _blocked(scene, generator) or _too_near(scene.scene, size, generator)
        if found:
            problems.append(
                f"at v = {v.round(3).tolist() if len(v) < 16 else f'number {index}'}: {found}"
            )
    return problems


def _blocked(scene: VariableScene, generator: np.random.Generator) -> str | None:
    for variable in scene.description.variables:
        places = np.array(
            [
                variable.value(generator.random(len(variable.components)))[:3]
                for _ in range(2 * SEGMENTS)
                if isinstance(variable, LookAt | CameraPath)
            ]
        )
        if not len(places):
            continue
        if isinstance(variable, CameraPath):
            steps = np.linspace(0, 1, SEGMENTS + 1)[:, None]
            path = np.array([variable.value(step)[:3] for step in steps])
            start, end = path[:-1], path[1:]
        else:
            start, end = places[:SEGMENTS], places[SEGMENTS:]
        length = np.linalg.norm(end - start, axis=1)
        start, end, length = start[length > 0], end[length > 0], length[length > 0]
        hit, _, distance = _intersect(scene.scene, start, (end - start) / length[:, None])
        if (inside := hit & (distance < length)).any():
            first = int(np.argmax(inside))
            place = start[first] + (end - start)[first] * distance[first] / length[first]
            where = place.round(3).tolist()
            return f"geometry reaches into the camera's range, for example at {where}"
    return None


def _too_near(scene: mi.Scene, size: float, generator: np.random.Generator) -> str | None:
    matrix = np.array(mi.traverse(scene.sensors()[0])["to_world"].matrix, dtype=np.float64)
    place = matrix.reshape(4, 4)[:3, 3]
    directions = generator.normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hit, behind, distance = _intersect(scene, np.broadcast_to(place, directions.shape), directions)
    nearest = distance[hit].min(initial=np.inf)
    if nearest < NEAREST * size:
        return f"the camera at {place.round(3).tolist()} is only {nearest:.3g} from a surface"
    if hit.all() and behind.all() and distance.max() < size / 4:
        return f"the camera at {place.round(3).tolist()} is inside an object"
    return None


def _intersect(
    scene: mi.Scene, origins: Points, directions: Points
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Points]:
    """For n rays: whether they hit, whether from behind, and the distance."""
    if mi.variant().startswith("scalar"):
        hits = [
            scene.ray_intersect(mi.Ray3f(mi.Point3f(*o), mi.Vector3f(*d)))
            for o, d in zip(origins.tolist(), directions.tolist(), strict=True)
        ]
        valid = np.array([bool(hit.is_valid()) for hit in hits])
        cosine = np.array([np.dot(hit.n, d) for hit, d in zip(hits, directions, strict=True)])
        return valid, cosine > 0, np.array([float(hit.t) for hit in hits])
    rays = mi.Ray3f(mi.Point3f(*origins.T), mi.Vector3f(*directions.T))
    hit = scene.ray_intersect(rays)
    cosine = np.sum(np.array(hit.n) * directions.T, axis=0)
    return np.array(hit.is_valid()), cosine > 0, np.array(hit.t, dtype=np.float64)
