"""What variables can reach of a loaded Mitsuba scene, found by object id and written in place."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from ngi.backend import dr, mi
from ngi.scene.assets import Bitmap, authored_to_world, load_vertices
from ngi.scene.bodies import Emission, Transformed, Vertices
from ngi.scene.changes import Changes
from ngi.scene.placement import Placement, parking
from ngi.scene.scene_files import SceneFile
from ngi.scene.variable import Values, Write


def has_surface(shape: mi.Shape) -> bool:
    """Whether a ray can hit the shape itself, not only what a group or an instance holds."""
    return not shape.class_name().startswith(("Instance", "ShapeGroup"))


class SceneParameters:
    """The `ngi.scene.variable.LoadedScene` of a Mitsuba scene; needs its variant to be active.

    document: what the scene was loaded from.
    size: diagonal of the scene's box.
    """

    def __init__(self, scene: mi.Scene, *, document: SceneFile, size: float) -> None:
        self._parameters = mi.traverse(scene)
        self._changes = Changes(scene, self._parameters)
        self._document = document
        self._file = document.path
        self._size = size
        self._found: set[str] = set()
        self._placements: dict[str, Placement] = {}
        self._emissions: dict[str, Emission] = {}
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
            new = kind(np.ascontiguousarray(value, dtype=numbers))
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
        dr.sync_thread()  # until no kernel is running that reads them
        memory = torch.from_dlpack(self._parameters[key])
        memory.copy_(torch.from_numpy(value))
        if memory.is_cuda:
            torch.cuda.synchronize()
        self._parameters.set_dirty(key)

    def placement(self, object_id: str) -> Placement:
        """Where an object stands, the same for all variables that act on it."""
        if object_id not in self._placements:
            owner = self.object(object_id)
            emits = isinstance(owner, mi.Shape) and owner.is_emitter()
            self._placements[object_id] = Placement(
                self._body(object_id, owner), parking=None if emits else parking(self._size)
            )
        return self._placements[object_id]

    def _body(self, object_id: str, owner: mi.Object) -> Vertices | Transformed:
        # Not every mi.Mesh is one of vertices: a rectangle has a to_world.
        if isinstance(owner, mi.Mesh) and owner.class_name() != "Rectangle":
            return Vertices(self, object_id)
        key = self.parameter(object_id, ("to_world",), hint="it has no place that could vary")
        return Transformed(self, key)

    def intensity(self, object_id: str) -> Write:
        """A function that sets the factor [1] on an emitter's colour."""
        return self._emission(object_id).set_factor

    def radiance(self, object_id: str) -> Write:
        """A function that sets an emitter's colour [3]."""
        emission = self._emission(object_id)
        if emission.colour.size != 3:
            raise ValueError(
                f"{self._file}: radiance of '{object_id}': it holds {emission.colour.size} "
                "number(s), not a colour; give the emitter's radiance as <rgb>"
            )
        return emission.set_colour

    def _emission(self, object_id: str) -> Emission:
        key = self.parameter(
            object_id,
            ("radiance.value", "intensity.value", "irradiance.value", "scale"),
            hint="name an emitter, or the shape that carries it, with a constant radiance",
        )
        if key not in self._emissions:  # which may be known by its own id and by its shape's
            self._emissions[key] = Emission(self, key)
        return self._emissions[key]

    def materials(self, object_id: str, bsdfs: Sequence[str]) -> Write:
        """A function that gives a shape, or all of an instance's, the BSDF of an index [1]."""
        owner = self.object(self._group_of(object_id))
        shapes = [
            shape
            for shape in self.objects(mi.Shape)
            if self._belongs_to(shape, owner) and has_surface(shape)
        ]
        if not shapes:
            raise ValueError(
                f"{self._file}: '{object_id}' has no shape whose material could vary; name a "
                "shape, a group or an instance"
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

    def _group_of(self, object_id: str) -> str:
        """The group that an instance shows, which is not a part of it; other ids as they are."""
        references = {
            instance.get("id"): ref.get("id", "")
            for instance in self._document.root.iterfind(".//shape[@type='instance']")
            for ref in instance.findall("ref")
        }
        group = references.get(object_id)
        if group is None:
            return object_id
        if len(sharing := [str(name) for name, g in references.items() if g == group]) > 1:
            raise ValueError(
                f"{self._file}: the instances {sharing} share the group '{group}' and its "
                "material; name the group instead"
            )
        return group

    def bitmap(self, key: str) -> Bitmap:
        return Bitmap(self, key)

    def mesh(self, object_id: str, path: Path) -> tuple[Values, Values | None]:
        """See `load_vertices`."""
        return load_vertices(self._document, object_id, path)

    def authored_to_world(self, object_id: str) -> Values:
        """See `ngi.scene.assets`."""
        return authored_to_world(self._document, object_id)

    def forget_the_rest(self) -> None:
        """Forgets what no variable asked for, since `update` visits each parameter it knows."""
        self._parameters.properties = {
            key: value for key, value in self._parameters.properties.items() if key in self._found
        }

    def update(self) -> None:
        """Has the scene take note of what was written."""
        for placement in self._placements.values():
            placement.flush()
        self._changes.tell()
