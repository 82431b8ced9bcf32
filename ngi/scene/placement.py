"""Where an object of a loaded scene stands, as all variables that act on it together say."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ngi.scene import transforms
from ngi.scene.variable import Values, Write


class Body(Protocol):
    """What a placement moves: something with a to_world, a point, or the vertices of a mesh.

    key: of the parameter that says where it is
    origin: [3], of the authored to_world
    """

    key: str
    origin: Values

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
    """

    def __init__(self, body: Body, *, parking: transforms.Matrix | None) -> None:
        self._body = body
        self._parking = parking
        self._steps: list[tuple[int, transforms.Matrix]] = []
        self._changed = False

    @property
    def origin(self) -> NDArray[np.float64]:
        """[3]: the origin of the authored to_world."""
        return self._body.origin

    def step(self, *, last: bool = False) -> Write:
        """A function that sets a matrix [4, 4] of this variable's own, in world space."""
        return self._slot(order=1 if last else 0)

    def switch(self) -> Write:
        """A function that makes the object vanish at 0 and appear at 1."""
        if self._parking is None:
            raise ValueError(
                "scene.yaml: an emitter cannot be hidden; vary its intensity, down to 0"
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
