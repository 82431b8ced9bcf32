"""Parameters of a loaded Mitsuba scene, found by object id and written so that kernels stay."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ngi.backend import dr, mi


class SceneParameters:
    """The `ngi.scene.properties.Parameters` of a Mitsuba scene; needs its variant to be active."""

    def __init__(self, scene: mi.Scene, *, scene_file: Path) -> None:
        self._parameters = mi.traverse(scene)
        self._file = scene_file
        self._found: list[str] = []
        self._objects = {
            node.id(): node
            for node in self._parameters.hierarchy
            if node.id() and not node.id().startswith("_")
        }

    def objects(self, kind: type) -> list[mi.Object]:
        """Every object of the scene of a class such as `mi.Shape`, in the order of the file."""
        return [node for node in self._parameters.hierarchy if isinstance(node, kind)]

    def key(self, object_id: str, suffixes: tuple[str, ...], *, hint: str) -> str:
        """The parameter of an object that ends with the first suffix found.

        Raises ValueError for an id that the scene does not have, with ids that look like it, and
        for an object without such a parameter, with the parameters that it has.
        """
        if object_id not in self._objects:
            near = get_close_matches(object_id, self._objects, n=3) or sorted(self._objects)
            raise ValueError(
                f"{self._file}: no object has the id '{object_id}' that scene.yaml names; "
                f"nearest: {', '.join(near)}"
            )
        owner = self._objects[object_id]
        keys = [
            key
            for key, (_, _, node, _) in self._parameters.properties.items()
            if self._belongs_to(node, owner)
        ]
        for suffix in suffixes:
            if matches := [key for key in keys if key.endswith("." + suffix)]:
                self._found.append(min(matches, key=lambda key: key.count(".")))
                return self._found[-1]
        raise ValueError(
            f"{self._file}: '{object_id}' ({owner.class_name()}) has no parameter "
            f"{' or '.join(suffixes)}, only {keys}; {hint}"
        )

    def _belongs_to(self, node: mi.Object | None, owner: mi.Object) -> bool:
        while node is not None and node != owner:
            node = self._parameters.hierarchy[node][0]
        return node is not None

    def read(self, key: str) -> NDArray[np.float64]:
        """The present value: [1], [3] for a colour or [4, 4] for a transform."""
        value = self._parameters[key]
        if isinstance(value, mi.AffineTransform4f | mi.ScalarAffineTransform4f):
            return np.array(value.matrix, dtype=np.float64).reshape(4, 4)
        return np.array(value, dtype=np.float64).reshape(-1)

    def write(self, key: str, value: NDArray[np.float64]) -> None:
        """Writes a value of the shape that `read` gives; `update` makes the scene take note.

        The value is uploaded, not a literal: a literal would be compiled into the kernels.
        """
        kind = type(self._parameters[key])
        if value.shape == (4, 4):
            new = kind(value) if mi.variant().startswith("scalar") else kind(mi.Matrix4f(value))
        else:
            new = kind(*map(float, value))
        dr.make_opaque(new)
        self._parameters[key] = new

    def forget_the_rest(self) -> None:
        """Forgets all parameters that `key` did not find, since `update` visits each it knows."""
        self._parameters.properties = {key: self._parameters.properties[key] for key in self._found}

    def update(self) -> None:
        """Tells the objects whose parameters were written, and their parents."""
        self._parameters.update()
