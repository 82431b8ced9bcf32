"""The parameters of a loaded Mitsuba scene, found by object id and written in place."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import dr, mi
from ngi.machine.hand_over import overwrite
from ngi.scene.changes import Changes
from ngi.scene.jit_variables import aligned
from ngi.scene.scene_files import SceneFile

MESH_BEHIND = "ngi_mesh_{}"
"""The id of a mesh that moves, whose own an instance has; see `ngi.scene.arrangement`."""


class Parameters:
    """What `mi.traverse` finds in a scene; needs its variant to be active.

    document: what the scene was loaded from.
    """

    def __init__(self, scene: mi.Scene, *, document: SceneFile) -> None:
        self.document = document
        self._parameters = mi.traverse(scene)
        self._changes = Changes(scene, self._parameters)
        self._file = document.path
        self._found: set[str] = set()
        self._taken: dict[Hashable, str] = {}
        self._taker = ""
        self._objects = {
            node.id(): node
            for node in self._parameters.hierarchy
            if node.id() and not node.id().startswith("_")
        }

    def objects(self, kind: type) -> list[mi.Object]:
        """Every object of the scene of a class such as `mi.Shape`, in the order of the file."""
        return [node for node in self._parameters.hierarchy if isinstance(node, kind)]

    def file(self, name: str) -> Path:
        """A file that scene.yaml names; FileNotFoundError where it is not there."""
        path = self._file.parent / name
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no such file, but scene.yaml names it")
        return path

    @contextmanager
    def taken_by(self, variable: str) -> Iterator[None]:
        """Whose the parameters are that are taken meanwhile; variable: its name, for errors."""
        self._taker = variable
        try:
            yield
        finally:
            self._taker = ""

    def take(self, what: Hashable, *, name: str) -> None:
        """ValueError, with its name, where another variable sets it already.

        Of two the last to change would win, so that the same v were not always the same scene.
        """
        if (other := self._taken.setdefault(what, self._taker)) != self._taker:
            raise ValueError(f"it sets {name}, which {other} sets too; remove one of the two")

    def parameter(
        self, object_id: str, suffixes: tuple[str, ...], *, hint: str, of: Sequence[str] = ()
    ) -> str:
        """As `find`, for one variable alone: ValueError as `take`."""
        key = self.find(object_id, suffixes, hint=hint, of=of)
        self.take(key, name=key)
        return key

    def find(
        self, object_id: str, suffixes: tuple[str, ...], *, hint: str, of: Sequence[str] = ()
    ) -> str:
        """The parameter of an object that ends with the first suffix found.

        of: Mitsuba's classes of what can have it; all where empty.

        Raises ValueError for an id that the scene does not have, with ids that look like it, for
        an object without such a parameter, with the parameters that it has, and for one of several
        parts that have it alike, with these.
        """
        owners = self._owners(object_id)
        keys = [
            key
            for key, (_, _, node, _) in self._parameters.properties.items()
            if any(self.belongs_to(node, owner) for owner in owners)
        ]
        name = f"'{object_id}' ({owners[-1].class_name()})"
        for suffix in suffixes:
            matches = [key for key in keys if key.endswith("." + suffix)]
            matches = [key for key in matches if not of or self.owner(key).class_name() in of]
            if matches:
                found: str = min(matches, key=lambda key: key.count("."))
                alike = [key for key in matches if key.count(".") == found.count(".")]
                if len(alike) > 1:
                    raise ValueError(
                        f"{self._file}: {name} has several {suffix}: {alike}; give an id to the "
                        "part you mean, and use that in scene.yaml"
                    )
                self._found.add(found)
                return found
        varies = f" that varies, as a {' or '.join(of)} has" if of else ""
        raise ValueError(
            f"{self._file}: {name} has no parameter {' or '.join(suffixes)}{varies}, only {keys}; "
            f"{hint}"
        )

    def object(self, object_id: str) -> mi.Object:
        """ValueError, naming ids that look like it, for one that the scene does not have."""
        if object_id not in self._objects:
            near = get_close_matches(object_id, self._objects, n=3) or sorted(self._objects)
            raise ValueError(
                f"{self._file}: no object has the id '{object_id}' that scene.yaml names; "
                f"nearest: {', '.join(near)}"
            )
        return self._objects[object_id]

    def _owners(self, object_id: str) -> list[mi.Object]:
        """What has the parameters of an id: the object, and the mesh that it is the instance of."""
        mesh = self._objects.get(MESH_BEHIND.format(object_id))
        return [self.object(object_id), *([] if mesh is None else [mesh])]

    def belongs_to(self, node: mi.Object | None, owner: mi.Object) -> bool:
        """Whether a node is an object or a part of it."""
        while node is not None and node != owner:
            node = self._parameters.hierarchy[node][0]
        return node is not None

    def is_made_of(self, object_id: str, classes: Sequence[str]) -> bool:
        """Whether an object, or a part of it, is of one of these classes of Mitsuba."""
        nodes = [node for node in self._parameters.hierarchy if node.class_name() in classes]
        owners = self._owners(object_id)
        return any(self.belongs_to(node, owner) for node in nodes for owner in owners)

    def shapes_in(self, group: mi.Object) -> int:
        """How many shapes with parameters are part of an object."""
        nodes = {node for _, _, node, _ in self._parameters.properties.values()}
        shapes = [node for node in nodes if isinstance(node, mi.Shape) and node != group]
        return sum(self.belongs_to(node, group) for node in shapes)

    def owner(self, key: str) -> mi.Object:
        """What a parameter belongs to."""
        owner: mi.Object = self._parameters.properties[key][2]
        return owner

    def value(self, key: str) -> Any:
        """The present value, as Mitsuba has it."""
        return self._parameters[key]

    def read(self, key: str) -> NDArray[np.float64]:
        """The present value: [1], [3] for a colour, [n] for vertices, [4, 4] for a transform,
        [height, width, channels] for a bitmap.
        """
        value = self._parameters[key]
        if isinstance(value, mi.AffineTransform4f | mi.ScalarAffineTransform4f):
            return np.array(value.matrix, dtype=np.float64).reshape(4, 4)
        array = np.array(value, dtype=np.float64)
        return array if array.ndim == 3 else array.reshape(-1)

    def write(self, key: str, value: NDArray[np.float64]) -> None:
        """Writes a value of the shape that `read` gives; `update` makes the scene take note.

        The value is uploaded, not a literal: a literal would be compiled into the kernels.
        """
        kind = type(self._parameters[key])
        if value.shape == (4, 4):
            self._changes.place(self.owner(key), value)
            new = kind(mi.ScalarTransform4f(value))  # which inverts it, without a kernel
        elif value.ndim == 3 or value.size > 4:
            numbers = np.uint8 if kind.__name__ == "TensorXu8" else np.float32
            new = kind(aligned(value, numbers))
        else:
            new = kind(*map(float, value))
        dr.make_opaque(new)
        self._parameters[key] = new

    def overwrite(self, key: str, value: NDArray[np.float64]) -> None:
        """As `write`, of an array [n] that keeps its memory, as the vertices of a mesh must.

        A frozen function of Dr.Jit 1.5 goes on reading them where they were when it was recorded.
        """
        if mi.variant().startswith("scalar"):
            self.write(key, value)
            return
        overwrite(self._parameters[key], value)
        self._parameters.set_dirty(key)

    def forget_the_rest(self) -> None:
        """Forgets what no variable asked for, since `update` visits each parameter it knows."""
        self._parameters.properties = {
            key: value for key, value in self._parameters.properties.items() if key in self._found
        }

    @property
    def rebuilds(self) -> int | None:
        """See `Changes.rebuilds`."""
        return self._changes.rebuilds

    def update(self) -> None:
        """Has the scene take note of what was written."""
        self._changes.tell()
