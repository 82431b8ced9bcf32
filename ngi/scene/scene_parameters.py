"""What variables can reach of a loaded Mitsuba scene, found by object id and written in place."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ngi.backend import dr, mi
from ngi.scene.placement import Placement, parking
from ngi.scene.transforms import Matrix
from ngi.scene.variable import Values, Write

_GROUPS = ("Instance", "ShapeGroup")


class SceneParameters:
    """The `ngi.scene.variable.LoadedScene` of a Mitsuba scene; needs its variant to be active.

    scene_file: where the scene comes from, for messages and for files beside it.
    size: diagonal of the scene's box.
    """

    def __init__(self, scene: mi.Scene, *, scene_file: Path, size: float) -> None:
        self._parameters = mi.traverse(scene)
        self._file = scene_file
        self._size = size
        self._found: set[str] = set()
        self._placements: dict[str, Placement] = {}
        self._emissions: dict[str, _Emission] = {}
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

    def parameter(self, object_id: str, suffixes: tuple[str, ...], *, hint: str) -> str:
        """The parameter of an object that ends with the first suffix found.

        Raises ValueError for an id that the scene does not have, with ids that look like it, and
        for an object without such a parameter, with the parameters that it has.
        """
        owner = self.object(object_id)
        keys = [
            key
            for key, (_, _, node, _) in self._parameters.properties.items()
            if self._belongs_to(node, owner)
        ]
        for suffix in suffixes:
            if matches := [key for key in keys if key.endswith("." + suffix)]:
                found = min(matches, key=lambda key: key.count("."))
                self._found.add(found)
                return found
        raise ValueError(
            f"{self._file}: '{object_id}' ({owner.class_name()}) has no parameter "
            f"{' or '.join(suffixes)}, only {keys}; {hint}"
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

    def _belongs_to(self, node: mi.Object | None, owner: mi.Object) -> bool:
        while node is not None and node != owner:
            node = self._parameters.hierarchy[node][0]
        return node is not None

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
            new = kind(value) if mi.variant().startswith("scalar") else kind(mi.Matrix4f(value))
        elif value.ndim == 3 or value.size > 4:
            new = kind(np.ascontiguousarray(value, dtype=np.float32))
        else:
            new = kind(*map(float, value))
        dr.make_opaque(new)
        self._parameters[key] = new

    def placement(self, object_id: str) -> Placement:
        """Where an object stands, the same for all variables that act on it."""
        if object_id not in self._placements:
            owner = self.object(object_id)
            emits = isinstance(owner, mi.Shape) and owner.is_emitter()
            self._placements[object_id] = Placement(
                self._body(object_id, owner), parking=None if emits else parking(self._size)
            )
        return self._placements[object_id]

    def _body(self, object_id: str, owner: mi.Object) -> _Mesh | _Transformed:
        if isinstance(owner, mi.Mesh):
            return _Mesh(self, object_id)
        key = self.parameter(object_id, ("to_world",), hint="it has no place that could vary")
        return _Transformed(self, key)

    def emission(self, object_id: str) -> tuple[Write, Write]:
        """Functions that set the factor [1] and the colour [3] of an emitter."""
        if object_id not in self._emissions:
            key = self.parameter(
                object_id,
                ("radiance.value", "intensity.value", "irradiance.value", "scale"),
                hint="name an emitter, or the shape that carries it, with a constant radiance",
            )
            self._emissions[object_id] = _Emission(self, key)
        emission = self._emissions[object_id]
        return emission.set_factor, emission.set_colour

    def materials(self, object_id: str, bsdfs: Sequence[str]) -> Write:
        """A function that gives a shape, or all of an instance's, the BSDF of an index [1]."""
        owner = self.object(object_id)
        shapes = [
            shape
            for shape in self.objects(mi.Shape)
            if self._belongs_to(shape, owner) and shape.class_name() not in _GROUPS
        ]
        if not shapes:
            raise ValueError(
                f"{self._file}: '{object_id}' has no shape of its own whose material could vary; "
                "where instances share a group, name the group or a shape in it"
            )
        choices = [self.object(name) for name in bsdfs]
        for name, choice in zip(bsdfs, choices, strict=True):
            if not isinstance(choice, mi.BSDF):
                raise ValueError(
                    f"{self._file}: '{name}' is no BSDF, so '{object_id}' can't have it"
                )

        def write(index: Values) -> None:
            for shape in shapes:
                shape.set_bsdf(choices[int(index[0])])

        return write

    def image(self, path: Path) -> NDArray[np.float64]:
        """[height, width, channels], as a bitmap texture holds it."""
        texture = mi.load_dict({"type": "bitmap", "filename": str(path)})
        return np.array(mi.traverse(texture)["data"], dtype=np.float64)

    def mesh(self, path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """Vertex positions [n, 3] of a PLY file, and its normals where it has them."""
        mesh = mi.load_dict({"type": "ply", "filename": str(path)})
        parameters = mi.traverse(mesh)
        positions = np.array(parameters["vertex_positions"], dtype=np.float64).reshape(-1, 3)
        normals = np.array(parameters["vertex_normals"], dtype=np.float64).reshape(-1, 3)
        return positions, normals if len(normals) else None

    def forget_the_rest(self) -> None:
        """Forgets what no variable asked for, since `update` visits each parameter it knows."""
        self._parameters.properties = {
            key: value for key, value in self._parameters.properties.items() if key in self._found
        }

    def update(self) -> None:
        """Tells the objects whose parameters were written, and their parents."""
        for placement in self._placements.values():
            placement.flush()
        self._parameters.update()


class _Transformed:
    """A body with a to_world: instance, sphere, rectangle, emitter or camera."""

    def __init__(self, parameters: SceneParameters, key: str) -> None:
        self._parameters, self._key = parameters, key
        # The authored matrix holds a sphere's radius and a rectangle's size too.
        self._authored = parameters.read(key)
        self.origin = self._authored[:3, 3].copy()

    def move(self, matrix: Matrix) -> None:
        self._parameters.write(self._key, matrix @ self._authored)

    def place(self, to_world: Values) -> None:
        self._authored = to_world

    def reshape(self, positions: Values, normals: Values | None) -> None:  # noqa: ARG002
        raise ValueError(
            f"scene.yaml: {self._key}: only a mesh outside of any group has key frames"
        )


class _Mesh:
    """A body of vertices, already in world space: a mesh that is no instance, such as a lamp."""

    def __init__(self, parameters: SceneParameters, object_id: str) -> None:
        hint = "it has no vertices"
        self._parameters = parameters
        self._keys = [
            parameters.parameter(object_id, (name,), hint=hint)
            for name in ("vertex_positions", "vertex_normals")
        ]
        self._positions, normals = (parameters.read(key).reshape(-1, 3) for key in self._keys)
        self._normals = normals if len(normals) else None
        self.origin = np.zeros(3)

    def move(self, matrix: Matrix) -> None:
        moved = self._positions @ matrix[:3, :3].T + matrix[:3, 3]
        self._parameters.write(self._keys[0], moved.reshape(-1))
        if self._normals is not None:  # written too: else Mitsuba would make up its own
            normals = self._normals @ np.linalg.inv(matrix[:3, :3])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            self._parameters.write(self._keys[1], normals.reshape(-1))

    def place(self, to_world: Values) -> None:  # noqa: ARG002
        raise ValueError(f"scene.yaml: {self._keys[0]}: a mesh cannot be placed by a matrix")

    def reshape(self, positions: Values, normals: Values | None) -> None:
        self._positions, self._normals = positions, normals


class _Emission:
    """Colour times factor of an emitter; either may vary."""

    def __init__(self, parameters: SceneParameters, key: str) -> None:
        self._parameters, self._key = parameters, key
        self._colour, self._factor = parameters.read(key), 1.0

    def set_factor(self, factor: Values) -> None:
        self._factor = float(factor[0])
        self._parameters.write(self._key, self._factor * self._colour)

    def set_colour(self, colour: Values) -> None:
        if colour.shape != self._colour.shape:
            raise ValueError(
                f"scene.yaml: {self._key} holds {self._colour.size} number(s), not a colour; give "
                "the emitter's radiance as <rgb>"
            )
        self._colour = colour
        self.set_factor(np.array([self._factor]))
