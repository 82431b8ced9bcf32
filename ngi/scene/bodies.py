"""What variables change of a scene's objects: a to_world, a point, vertices, an emitted colour."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ngi.scene.assets import authored_to_world
from ngi.scene.parameters import Parameters
from ngi.scene.placement import Body
from ngi.scene.transforms import Matrix
from ngi.scene.variable import Values


class Transformed(Body):
    """A body with a to_world: instance, sphere, rectangle, emitter or camera."""

    def __init__(self, parameters: Parameters, key: str) -> None:
        self._parameters, self.key = parameters, key
        # The authored matrix holds a sphere's radius and a rectangle's size too.
        self._authored = parameters.read(key)
        self.origin = self._authored[:3, 3].copy()

    def move(self, matrix: Matrix) -> None:
        self._parameters.write(self.key, matrix @ self._authored)

    def place(self, to_world: Values) -> None:
        self._authored = to_world


class Positioned(Body):
    """A body that is a point: a light without a direction."""

    def __init__(self, parameters: Parameters, key: str) -> None:
        self._parameters, self.key = parameters, key
        self.origin = parameters.read(key)

    def move(self, matrix: Matrix) -> None:
        self._parameters.write(self.key, matrix[:3, :3] @ self.origin + matrix[:3, 3])


class Vertices(Body):
    """A body of vertices, already in world space: a mesh that is no instance, such as a lamp."""

    def __init__(self, parameters: Parameters, object_id: str) -> None:
        hint = "it has no vertices"
        self._parameters, self._id = parameters, object_id
        self._keys = [
            parameters.parameter(object_id, (name,), hint=hint)
            for name in ("vertex_positions", "vertex_normals")
        ]
        self.key = self._keys[0]
        self._positions, normals = (parameters.read(key).reshape(-1, 3) for key in self._keys)
        self._normals = normals if len(normals) else None

    @cached_property
    def origin(self) -> Values:  # type: ignore[override]  # found where it is asked for
        return authored_to_world(self._parameters.document, self._id)[:3, 3]

    def move(self, matrix: Matrix) -> None:
        moved = self._positions @ matrix[:3, :3].T + matrix[:3, 3]
        self._parameters.overwrite(self.key, moved.reshape(-1))
        if self._normals is not None:  # written too: else Mitsuba would make up its own
            normals = self._normals @ np.linalg.inv(matrix[:3, :3])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            self._parameters.overwrite(self._keys[1], normals.reshape(-1))

    def reshape(self, positions: Values, normals: Values | None) -> None:
        self._positions, self._normals = positions, normals


class Emission:
    """Colour times factor of an emitter; either may vary."""

    def __init__(self, parameters: Parameters, key: str) -> None:
        self._parameters, self._key = parameters, key
        self.colour, self._factor = parameters.read(key), 1.0

    def set_factor(self, factor: Values) -> None:
        self._factor = float(factor[0])
        self._parameters.write(self._key, self._factor * self.colour)

    def set_colour(self, colour: Values) -> None:
        self.colour = colour
        self.set_factor(np.array([self._factor]))
