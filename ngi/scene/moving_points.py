"""Where the things are that a scene's variables move along, as a function of v."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from ngi.machine.backend import mi
from ngi.patches import MovingPoints
from ngi.scene.description import SceneDescription
from ngi.scene.kinds import Shape, Translation
from ngi.scene.scene_parameters import emits
from ngi.scene.variable import Variable
from ngi.scene.variable_scene import VariableScene

MOST = 4
"""Points at most: a network is given eight numbers per pixel and point."""


@dataclass(frozen=True)
class _Moved:
    """centre: [3] at some v. columns: [3, n], what each component of the variable adds to it."""

    centre: NDArray[np.float64]
    columns: NDArray[np.float64]
    part: slice
    emits: bool

    @property
    def rank(self) -> tuple[bool, float]:
        """The smallest first: lights, then what moves farthest."""
        return not self.emits, -float(np.linalg.norm(self.columns.sum(axis=1)))


def moving_points(scene: VariableScene) -> MovingPoints:
    """The centres of what translations move; of more than `MOST` the lights, then the farthest.

    The objects of one variable are one thing, whose centre is that of the box around them. A
    rotation or a scale about another point than this centre is left out of account. The scene is
    left at some v.
    """
    description = scene.description
    v = description.with_first_materials(np.full(description.dimensions, 0.5))
    scene.apply(v)
    moved = [
        _moved(scene, variable, part, v)
        for variable, part in description.parts()
        if isinstance(variable, Translation) and part.stop > part.start and _seen(scene, variable)
    ]
    low, high = np.array(description.bounds)
    sides = high - low
    weight = np.zeros((min(MOST, len(moved)), 3, description.dimensions))
    offset = np.zeros((len(weight), 3))
    for k, point in enumerate(sorted(moved, key=lambda point: point.rank)[:MOST]):
        weight[k, :, point.part] = point.columns / sides[:, None]
        offset[k] = (point.centre - low) / sides - weight[k] @ v
    tensors = (torch.from_numpy(array).float() for array in (weight, offset, sides / sides.max()))
    return MovingPoints(*tensors)


def _seen(scene: VariableScene, variable: Variable) -> bool:
    """Whether a camera sees what it moves, or sees by its light."""
    return all(isinstance(owner, mi.Shape | mi.Emitter) for owner in scene.owners(variable))


def _moved(scene: VariableScene, variable: Variable, part: slice, v: NDArray[np.float64]) -> _Moved:
    """v: [D] that the scene is at, and is left at."""
    owners = scene.owners(variable)
    boxes = []
    for name, owner in zip(variable.objects, owners, strict=True):
        shown = _showing(scene.description, name, v)
        if changed := not np.array_equal(shown, v):
            scene.apply(shown)
        boxes.append(_box(owner))
        if changed:
            scene.apply(v)
    low, high = np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]
    count = part.stop - part.start
    start = variable.value(np.zeros(count))
    columns = np.stack([variable.value(unit) - start for unit in np.eye(count)], axis=1)
    return _Moved((low + high) / 2, columns, part, any(map(emits, owners)))


def _showing(
    description: SceneDescription, name: str, v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The same v [D], but with this object where it takes turns with others."""
    shown = v.copy()
    for variable, part in description.parts():
        if isinstance(variable, Shape) and name in variable.choices:
            shown[part] = (variable.choices.index(name) + 0.5) / len(variable.choices)
    return shown


def _box(owner: mi.Object) -> NDArray[np.float64]:
    """[2, 3]: the corners of its box; of what has none, such as a projector, the place twice."""
    box = owner.bbox()
    if box.valid():
        return np.array([np.ravel(box.min), np.ravel(box.max)], np.float64)
    to_world = np.array(mi.traverse(owner)["to_world"].matrix, np.float64).reshape(4, 4)
    return np.stack([to_world[:3, 3]] * 2)
