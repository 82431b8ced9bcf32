"""Where an object of a loaded scene stands, as all variables that act on it say, and its light."""

from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ngi.scene import transforms
from ngi.scene.assets import authored_to_world
from ngi.scene.parameters import Parameters
from ngi.scene.transforms import Matrix
from ngi.scene.variable import Values, Write


class Body(Protocol):
    """What a placement moves: something with a to_world, a point, or the vertices of a mesh.

    key: of the parameter that says where it is
    origin: [3], of the authored to_world
    mirrors: whether that turns left into right
    """

    key: str
    origin: Values
    mirrors: bool = False

    def move(self, matrix: transforms.Matrix) -> None: ...

    def place(self, to_world: Values) -> None:  # noqa: ARG002
        raise ValueError(
            f"scene.yaml: {self.key}: only what has a to_world can be placed by a matrix"
        )

    def reshape(self, positions: Values, normals: Values | None) -> None:  # noqa: ARG002
        raise ValueError(f"scene.yaml: {self.key}: only a mesh outside of any group has key frames")


class Placement:
    """to_world = [parked if hidden] last steps * (steps, the first one rightmost) * authored.

    Steps are set one by one; `flush` writes what came of them, once.

    parking: the matrix that takes an object out of sight, see `parking`.
    turned: whether it is part of a group that an instance turns or scales
    """

    def __init__(
        self, body: Body, *, parking: transforms.Matrix | None, turned: bool = False
    ) -> None:
        self._body = body
        self._parking = parking
        self._turned = turned
        self._steps: list[tuple[int, transforms.Matrix]] = []
        self._changed = False

    @property
    def origin(self) -> NDArray[np.float64]:
        """[3]: the origin of the authored to_world."""
        return self._body.origin

    @property
    def mirrors(self) -> bool:
        """Whether the authored to_world turns left into right."""
        return self._body.mirrors

    def step(self, *, last: bool = False) -> Write:
        """A function that sets a matrix [4, 4] of this variable's own, in world space."""
        if self._turned:
            raise ValueError(
                f"scene.yaml: {self._body.key} is part of a group that an instance turns or scales "
                "and would not move along the world's axes; name the instances"
            )
        return self._slot(order=1 if last else 0)

    def switch(self) -> Write:
        """A function that makes the object vanish at 0 and appear at 1."""
        if self._parking is None:
            raise ValueError(
                "scene.yaml: an emitter cannot be hidden; vary its intensity down to 0 instead"
            )
        hidden = self._parking
        set_matrix = self._slot(order=2)
        return lambda visible: set_matrix(np.eye(4) if visible[0] else hidden)

    def place(self, to_world: Values) -> None:
        """Replaces the authored to_world."""
        self._body.place(to_world)
        self._changed = True

    def reshape(self, positions: Values, normals: Values | None) -> None:
        """Replaces a mesh's authored vertices [n, 3]."""
        self._body.reshape(positions, normals)
        self._changed = True

    def flush(self) -> None:
        if not self._changed:
            return
        matrix = np.eye(4)
        for _, step in sorted(self._steps, key=lambda entry: entry[0]):
            matrix = step @ matrix
        self._body.move(matrix)
        self._changed = False

    def _slot(self, *, order: int) -> Write:
        index = len(self._steps)
        self._steps.append((order, np.eye(4)))

        def write(matrix: Values) -> None:
            self._steps[index] = (order, matrix)
            self._changed = True

        return write


def parking(size: float) -> transforms.Matrix:
    """Out of sight: a thousand scene sizes away, a thousand times smaller.

    From there an object covers a millionth of a radian: no pixel shows it, no light cares.
    """
    return transforms.translation(np.array([0.0, -1e3 * size, 0.0])) @ transforms.scale(1e-3)


class Transformed(Body):
    """A body with a to_world: instance, sphere, rectangle, emitter or camera."""

    def __init__(self, parameters: Parameters, key: str) -> None:
        self._parameters, self.key = parameters, key
        # The authored matrix holds a sphere's radius and a rectangle's size too.
        self._authored = parameters.read(key)
        self.origin = self._authored[:3, 3].copy()
        self.mirrors = transforms.mirrors(self._authored)

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
            parameters.find(object_id, (name,), hint=hint)
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
        self._parameters, self.key = parameters, key
        self.colour, self._factor = parameters.read(key), 1.0

    def set_factor(self, factor: Values) -> None:
        self._factor = float(factor[0])
        self._parameters.write(self.key, self._factor * self.colour)

    def set_colour(self, colour: Values) -> None:
        self.colour = colour
        self.set_factor(np.array([self._factor]))
