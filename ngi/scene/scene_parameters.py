"""What variables can do to a loaded Mitsuba scene: move, show, light and dress its objects."""

from __future__ import annotations

from collections.abc import Sequence, Set
from pathlib import Path

import numpy as np

from ngi.machine.backend import mi
from ngi.scene.assets import Bitmap, load_vertices
from ngi.scene.parameters import Parameters
from ngi.scene.placement import (
    Body,
    Emission,
    Placement,
    Positioned,
    Transformed,
    Vertices,
    parking,
)
from ngi.scene.scene_files import SceneFile
from ngi.scene.variable import Values, Write

EMISSIONS = ("radiance.value", "intensity.value", "irradiance.value", "scale")
"""Parameters of emitters whose factor `intensity` is, in the order in which they are looked for."""


def has_surface(shape: mi.Shape) -> bool:
    """Whether a ray can hit the shape itself, not only what a group or an instance holds."""
    return not shape.class_name().startswith(("Instance", "ShapeGroup"))


def is_infinite(owner: mi.Object) -> bool:
    """Whether it is an emitter that is infinitely far away."""
    return isinstance(owner, mi.Emitter) and mi.has_flag(owner.flags(), mi.EmitterFlags.Infinite)


def emits(owner: mi.Object) -> bool:
    """Whether it is an emitter, or a shape that carries one."""
    return isinstance(owner, mi.Emitter) or (isinstance(owner, mi.Shape) and owner.is_emitter())


class SceneParameters(Parameters):
    """The `ngi.scene.variable.LoadedScene` of a Mitsuba scene; needs its variant to be active.

    document: what the scene was loaded from.
    size: diagonal of the scene's box.
    turning: ids of the objects that variables turn or scale
    """

    def __init__(
        self, scene: mi.Scene, *, document: SceneFile, size: float, turning: Set[str]
    ) -> None:
        super().__init__(scene, document=document)
        self._turning = turning
        self._size = size
        self._placements: dict[str, Placement] = {}
        self._emissions: dict[str, Emission] = {}

    def placement(
        self, object_id: str, *, only: Sequence[str] = (), finite: bool = False
    ) -> Placement:
        """Where an object stands, the same for all variables that act on it, by whatever name.

        only: Mitsuba's classes of what can stand so; all where empty. finite: not what is
        infinitely far away.
        """
        owner = self.object(object_id)
        if only and owner.class_name() not in only:
            raise ValueError(
                f"{self._file}: '{object_id}' is a {owner.class_name()}; name one of {list(only)}"
            )
        body = self._body(object_id, owner)
        if finite and is_infinite(owner):
            raise ValueError(
                f"{self._file}: '{object_id}' is infinitely far away, like every "
                f"{owner.class_name()}; vary its rotation, or a sun's direction"
            )
        if body.key not in self._placements:  # a group has that of what is in it
            parked = None if emits(owner) else parking(self._size)
            turned = self._turned(owner)
            self._placements[body.key] = Placement(body, parking=parked, turned=turned)
        return self._placements[body.key]

    def _turned(self, owner: mi.Object) -> bool:
        """Whether it is in a group that an instance turns or scales: along other axes."""
        instances = [one for group, one in self.groups() if self.belongs_to(owner, group)]
        places = [np.array(mi.traverse(one)["to_world"].matrix) for one in instances]
        authored = any(not np.allclose(p.reshape(4, 4)[:3, :3], np.eye(3)) for p in places)
        return authored or any(one.id() in self._turning for one in instances)

    def _body(self, object_id: str, owner: mi.Object) -> Body:
        # Not every mi.Mesh is one of vertices: a rectangle has a to_world.
        if isinstance(owner, mi.Mesh) and owner.class_name() != "Rectangle":
            return Vertices(self, object_id)
        if owner.class_name().startswith("ShapeGroup") and self.shapes_in(owner) > 1:
            raise ValueError(
                f"{self._file}: '{object_id}' is a group of several shapes, which do not move as "
                "one; name the instances that show it"
            )
        key = self.find(
            object_id,
            ("to_world", "position"),
            hint="its place cannot vary; to move a lamp, name its shape",
        )
        return Transformed(self, key) if key.endswith("to_world") else Positioned(self, key)

    def intensity(self, object_id: str) -> Write:
        """A function that sets the factor [1] on an emitter's colour."""
        emission = self._emission(object_id)
        self.take(("intensity", emission.key), name=f"the intensity of {emission.key}")
        return emission.set_factor

    def radiance(self, object_id: str) -> Write:
        """A function that sets an emitter's colour [3]."""
        emission = self._emission(object_id)
        self.take(("colour", emission.key), name=f"the colour of {emission.key}")
        if emission.colour.size != 3:
            raise ValueError(
                f"{self._file}: radiance of '{object_id}': it holds {emission.colour.size} "
                "number(s), not a colour; give the emitter's radiance as <rgb>"
            )
        return emission.set_colour

    def _emission(self, object_id: str) -> Emission:
        hint = "name an emitter, or the shape that carries it, with a constant radiance"
        key = self.find(object_id, EMISSIONS, hint=hint)
        if key.endswith(".scale") and not isinstance(self.owner(key), mi.Emitter):
            raise ValueError(f"{self._file}: {key} of '{object_id}' is not an emitter's; {hint}")
        if key not in self._emissions:  # which may be known by its own id and by its shape's
            self._emissions[key] = Emission(self, key)
        return self._emissions[key]

    def materials(self, object_id: str, bsdfs: Sequence[str]) -> Write:
        """A function that gives a shape, or all of an instance's, the BSDF of an index [1]."""
        shapes = self.dressed(object_id)
        for shape in shapes:
            self.take(shape, name=f"the material of '{shape.id() or shape.class_name()}'")
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

    def dressed(self, object_id: str) -> list[mi.Shape]:
        """The shape, or all of a group's or an instance's, whose material can vary."""
        owner = self.object(self._group_of(object_id))
        shapes = [
            shape
            for shape in self.objects(mi.Shape)
            if self.belongs_to(shape, owner) and has_surface(shape)
        ]
        if not shapes:
            raise ValueError(
                f"{self._file}: '{object_id}' has no shape whose material could vary; name a "
                "shape, a group or an instance"
            )
        return shapes

    def _group_of(self, object_id: str) -> str:
        """The group that an instance shows, which is not a part of it; other ids as they are."""
        references = self._references()
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
        return load_vertices(self.document, object_id, path)

    def update(self) -> None:
        """Has the scene take note of what was written."""
        for placement in self._placements.values():
            placement.flush()
        super().update()

    def groups(self) -> list[tuple[mi.Shape, mi.Shape]]:
        """The group that each instance shows, and the instance, in the order of the file."""
        by_id = {node.id(): node for node in self.objects(mi.Shape)}
        instances = [s for s in self.objects(mi.Shape) if s.class_name().startswith("Instance")]
        elements = self.document.root.iterfind(".//shape[@type='instance']")
        return [
            (by_id[ref.get("id", "")], instance)
            for element, instance in zip(elements, instances, strict=True)
            if (ref := element.find("ref")) is not None
        ]

    def _references(self) -> dict[str, str]:
        """Id of an instance -> id of the group that it shows."""
        return {
            instance.get("id", ""): ref.get("id", "")
            for instance in self.document.root.iterfind(".//shape[@type='instance']")
            for ref in instance.findall("ref")
        }
