"""A Mitsuba scene whose variables are set by the scene vector v, mutated in place."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.machine.backend import mi
from ngi.scene.arrangement import arranged, moving, turning
from ngi.scene.description import SceneDescription
from ngi.scene.kinds import Material
from ngi.scene.loading import load
from ngi.scene.reach import Reach
from ngi.scene.scene_parameters import SceneParameters, has_surface
from ngi.scene.variable import DiscreteVariable, Variable, Write


class VariableScene:
    """A loaded scene at some v; loaded once per process, since loading in a loop leaks memory.

    The Mitsuba variant that is active at construction must be active at every later call. Raises
    ValueError where scene.yaml names an object or property that scene.xml does not have.

    arrange: put what never moves behind one instance, see `ngi.scene.arrangement`.
    """

    def __init__(self, description: SceneDescription, *, arrange: bool = True) -> None:
        self.description = description
        document = description.document
        if arrange:
            document = arranged(document, description.variables)
        self.scene: mi.Scene = load(document)
        self._parameters = SceneParameters(
            self.scene,
            document=document,
            size=float(np.linalg.norm(np.subtract(*description.bounds))),
            turning=turning(description.variables),
        )
        self._reach = Reach(self.scene, description.bounds)
        self._reach.extend()
        self.shapes: list[mi.Shape] = self._parameters.objects(mi.Shape)
        self._writes = [self._bind(variable) for variable in description.variables]
        self._parameters.forget_the_rest()
        self._values: list[NDArray[np.float64] | None] = [None] * len(self._writes)
        self._of_cameras = [self._is_of_cameras(variable) for variable in description.variables]
        self.changes = 0
        """How often something else than the camera has changed."""

    def _bind(self, variable: Variable) -> Write:
        """ValueError, naming the file and the variable, also for what Mitsuba does not take."""
        place = f"{'+'.join(variable.objects)}.{variable.kind}"
        try:
            self._check_camera(variable)
            with self._parameters.taken_by(place):
                return variable.bind(self._parameters)
        except (ValueError, RuntimeError) as error:
            path = str(self.description.document.path)
            prefix = "" if path in str(error) else f"{path}: {place}: "
            raise ValueError(f"{prefix}{error}") from error

    def _check_camera(self, variable: Variable) -> None:
        """ValueError for what would only place cameras that are not rendered."""
        owners = [] if isinstance(variable, DiscreteVariable) else self.owners(variable)
        first = next(iter(self.scene.sensors()), None)
        if owners and all(isinstance(owner, mi.Sensor) and owner != first for owner in owners):
            name = f", '{first.id()}'," if first is not None and first.id() else ""
            raise ValueError(
                f"'{owners[0].id()}' is not rendered: only the first sensor of the file{name} is; "
                "name that sensor, or move this one to the front"
            )

    def _is_of_cameras(self, variable: Variable) -> bool:
        """Whether it changes what the scene looks like from somewhere, and nothing else."""
        if isinstance(variable, DiscreteVariable):
            return False
        return all(isinstance(owner, mi.Sensor) for owner in self.owners(variable))

    @cached_property
    def moving(self) -> frozenset[str]:
        """Ids of the shapes and cameras that some variable places, shows or hides."""
        return frozenset(moving(self.description.variables))

    @cached_property
    def affected(self) -> frozenset[str]:
        """What of the buffers differs with v: camera, position, albedo, roughness, emission."""
        affected = {name for v in self.description.variables for name in self._affects(v)}
        if self.scene.sensors()[0].id() in self.moving:
            affected.add("camera")
        return frozenset(affected)

    def _affects(self, variable: Variable) -> frozenset[str]:
        """What a variable changes of the buffers, of all that its kind can change."""
        if isinstance(variable, DiscreteVariable):
            return variable.affects
        owners = self.owners(variable)
        if not all(isinstance(owner, mi.Emitter) for owner in owners):
            return variable.affects
        never_seen = mi.EmitterFlags.Delta
        if all(mi.has_flag(owner.flags(), never_seen) for owner in owners):
            return frozenset()
        return variable.affects - {"position"}

    def owners(self, variable: Variable) -> list[mi.Object]:
        """Mitsuba's objects that a variable acts on."""
        return [self._parameters.object(name) for name in variable.objects]

    def bsdfs(self) -> list[mi.BSDF]:
        """Every BSDF that a ray can hit at some v."""
        bsdfs: list[mi.BSDF] = []
        for shape in self.shapes:
            for bsdf in self.bsdfs_of(shape) if has_surface(shape) else ():
                if bsdf not in bsdfs:
                    bsdfs.append(bsdf)
        return bsdfs

    @cached_property
    def choices(self) -> list[mi.BSDF]:
        """What variables give shapes in place of their own."""
        materials = (v for v in self.description.variables if isinstance(v, Material))
        return [self._parameters.object(name) for v in materials for name in v.choices]

    @property
    def changing(self) -> list[mi.Object]:
        """Every shape, and whatever else some variable acts on."""
        variables = (v for v in self.description.variables if not isinstance(v, DiscreteVariable))
        return [*self.shapes, *(owner for variable in variables for owner in self.owners(variable))]

    @property
    def rebuilds(self) -> int | None:
        """How often Mitsuba has built the scene anew; None where every change has it do so."""
        return self._parameters.rebuilds

    def bsdfs_of(self, shape: mi.Shape) -> list[mi.BSDF]:
        """Its own, and those that variables give it at some v."""
        chosen = [
            self._parameters.object(name)
            for variable in self.description.variables
            if isinstance(variable, Material)
            and any(shape in self._parameters.dressed(dressed) for dressed in variable.objects)
            for name in variable.choices
        ]
        return [shape.bsdf(), *chosen]

    def placed(self) -> list[tuple[mi.Shape, mi.Shape | None]]:
        """Every shape that a ray can hit, with the instance that shows it, if any: as often as
        there are such instances.
        """
        shapes = [shape for shape in self.shapes if has_surface(shape)]
        groups = self._parameters.groups()
        shown = [
            (shape, instance)
            for group, instance in groups
            for shape in shapes
            if self._parameters.belongs_to(shape, group)
        ]
        inside = [shape for shape, _ in shown]
        return [(shape, None) for shape in shapes if shape not in inside] + shown

    def apply(self, scene_vector: ArrayLike) -> None:
        """Sets the scene to v of shape [D] in [0, 1]; ValueError for any other v.

        Only what changed since the last v is written, so that an unmoved shape is never rebuilt.
        """
        values = self.description.values(scene_vector)
        try:
            self._write(values)
        except BaseException:  # part of it is there, and Mitsuba may not know
            self._values = [None] * len(self._values)
            self.changes += 1
            raise

    def _write(self, values: Sequence[NDArray[np.float64]]) -> None:
        changed = False
        for i, (write, value) in enumerate(zip(self._writes, values, strict=True)):
            present = self._values[i]
            if present is None or not np.array_equal(present, value):
                write(value)
                self._values[i] = value
                changed = True
                self.changes += not self._of_cameras[i]
        if changed:
            built = self.rebuilds
            self._parameters.update()
            if built is None or built != self.rebuilds:
                self._reach.extend()
