"""Variables of where objects are, which of them are there, and of a mesh's shape."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ngi.scene import transforms
from ngi.scene.variable import (
    DiscreteVariable,
    LoadedScene,
    RangedVariable,
    Values,
    Variable,
    Write,
    in_turn,
)
from ngi.scene.yaml_keys import Vector, YamlKeys


@dataclass(frozen=True)
class Translation(RangedVariable):
    """Offset in world space from the authored place, after any rotation and scale."""

    kind = "translation"
    affects = frozenset({"position"})
    numbers = ("x", "y", "z")

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        step = scene.placement(object_id, finite=True).step(last=True)
        return lambda offset: step(transforms.translation(offset))


@dataclass(frozen=True)
class Rotation(RangedVariable):
    """Degrees about an axis in world space, counter-clockwise seen against it.

    axis: of any length. pivot: a point on the axis; where None, the origin of the object's
    authored to_world. It also turns environment maps and directional emitters.
    """

    axis: Vector = (0.0, 1.0, 0.0)
    pivot: Vector | None = None

    kind = "rotation"
    affects = frozenset({"position", "emission"})
    unit = "degrees"

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        placement = scene.placement(object_id)
        pivot = placement.origin if self.pivot is None else np.array(self.pivot)
        step = placement.step()
        return lambda degrees: step(
            transforms.about(pivot, transforms.rotation(np.array(self.axis), degrees[0]))
        )

    @classmethod
    def read_options(cls, objects: tuple[str, ...], keys: YamlKeys) -> dict[str, Any]:
        axis = keys.numbers("axis", length=3)
        if not any(axis):
            raise keys.error("axis", list(axis), "give a direction, such as [0, 1, 0]")
        return {"axis": axis, "pivot": _pivot(objects, keys)}


@dataclass(frozen=True)
class Scale(RangedVariable):
    """Uniform factor on the size; pivot: the point that stays, as in `Rotation`."""

    pivot: Vector | None = None

    kind = "scale"
    affects = frozenset({"position"})
    limits = (1e-6, 1e6)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        placement = scene.placement(object_id, finite=True)
        pivot = placement.origin if self.pivot is None else np.array(self.pivot)
        step = placement.step()
        return lambda factor: step(transforms.about(pivot, transforms.scale(factor[0])))

    @classmethod
    def read_options(cls, objects: tuple[str, ...], keys: YamlKeys) -> dict[str, Any]:
        return {"pivot": _pivot(objects, keys)}


def _pivot(objects: tuple[str, ...], keys: YamlKeys) -> Vector | None:
    if "pivot" in keys:
        return keys.numbers("pivot", length=3)
    if len(objects) > 1:
        raise keys.error("pivot", None, f"give the point about which {list(objects)} turn together")
    return None


@dataclass(frozen=True)
class Visibility(DiscreteVariable):
    """Whether objects are there: below one half they are not. Emitters cannot vanish."""

    choices: tuple[str, ...] = ("hidden", "visible")

    kind = "visibility"
    affects = frozenset({"position"})

    def bind(self, scene: LoadedScene) -> Write:
        return in_turn([scene.placement(object_id).switch() for object_id in self.objects])

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:  # noqa: ARG003
        return cls(objects)


@dataclass(frozen=True)
class Shape(DiscreteVariable):
    """Which one of several objects is there; `objects` is only the choice's name."""

    kind = "shape"
    affects = frozenset({"position"})

    @property
    def shown(self) -> tuple[str, ...]:
        """Ids of the objects, in the order of the choices."""
        return self.choices

    def bind(self, scene: LoadedScene) -> Write:
        switches = [scene.placement(object_id).switch() for object_id in self.shown]

        def write(value: Values) -> None:
            for index, switch in enumerate(switches):
                switch(np.array([float(index == value[0])]))

        return write


@dataclass(frozen=True)
class KeyFrames(Variable):
    """A mesh between key frames, which are interpolated linearly (paper, Sec. 9).

    objects: one mesh. frames: PLY files with the same vertices in the same order, for equally
    spaced components from 0 to 1, in the mesh's own coordinates.
    """

    frames: tuple[str, ...]

    kind = "key_frames"
    affects = frozenset({"position"})

    @property
    def range(self) -> str:
        return " ... ".join(self.frames)

    @property
    def files(self) -> tuple[str, ...]:
        return self.frames

    def value(self, components: Values) -> Values:
        """[1]: the place among the key frames, from 0 to n - 1."""
        return components * (len(self.frames) - 1)

    def bind(self, scene: LoadedScene) -> Write:
        (object_id,) = self.objects
        placement = scene.placement(object_id)
        meshes = [scene.mesh(object_id, scene.file(name)) for name in self.frames]

        def write(place: Values) -> None:
            before = min(int(place[0]), len(meshes) - 2)
            weight = place[0] - before
            (p, n), (q, m) = meshes[before], meshes[before + 1]
            positions = p + weight * (q - p)
            normals = None
            if n is not None and m is not None:
                normals = n + weight * (m - n)
                length = np.linalg.norm(normals, axis=1, keepdims=True)
                near = n if weight < 0.5 else m  # where they point apart, and nothing is between
                normals = np.where(length > 1e-6, normals / np.maximum(length, 1e-6), near)
            placement.reshape(positions, normals)

        return write

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        if len(objects) != 1:
            raise keys.error("object", list(objects), "key frames belong to one mesh")
        return cls(objects, keys.names("files", at_least=2))
