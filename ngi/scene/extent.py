"""Whether the box of the scene holds its geometry, and whether a camera always has a direction."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ngi.scene.description import SceneDescription
from ngi.scene.kinds import LookAt
from ngi.scene.scene_parameters import has_surface
from ngi.scene.variable_scene import VariableScene

CONFIGURATIONS = 8
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
    for v in _configurations(scene.description):
        scene.apply(v)
        for shape in filter(has_surface, scene.shapes):
            box = shape.bbox()
            out = np.maximum(low - np.array(box.min).ravel(), np.array(box.max).ravel() - high)
            farthest[shape.id()] = max(farthest.get(shape.id(), 0.0), float(out.max()))
    size = float(np.linalg.norm(high - low))
    return [
        f"'{name}' reaches {far:.3g} out of bounds; where the camera can see that, widen bounds"
        for name, far in sorted(farthest.items(), key=lambda item: -item[1])
        if far > TOLERANCE * size
    ]


def meeting_views(description: SceneDescription) -> list[str]:
    """A line for every look_at whose origin and target can be the same point."""
    return [
        f"{'+'.join(variable.objects)}.look_at: origin and target can meet, for example at "
        f"{place.round(3).tolist()}, where the camera looks nowhere; keep their ranges apart along "
        "one axis"
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


def _configurations(description: SceneDescription) -> Iterator[np.ndarray]:
    generator = np.random.default_rng(0)
    for index in range(CONFIGURATIONS):
        v = generator.random(description.dimensions)
        v = np.full_like(v, index) if index < 2 else v
        yield description.with_first_materials(v)
