"""What a variable scene is: a Mitsuba 3 file, and what varies in it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.scene.kinds import CameraPath, FieldOfView, LookAt, Material, Shape, Visibility
from ngi.scene.scene_files import SceneFile
from ngi.scene.transforms import Matrix, look_at
from ngi.scene.variable import Variable
from ngi.scene.yaml_keys import Vector


@dataclass(frozen=True)
class SceneDescription:
    """A variable scene.

    document: the stock Mitsuba 3 file, whose names of files count from its folder.
    samples_per_pixel: of training patches.
    max_depth: longest path in vertices, as Mitsuba counts, -1 for no limit; equal to the one in
        the scene file.
    bounds: minimum and maximum corner of a world-space box over the whole range of the variables,
        which normalises positions (the scene's own box moves with the variables).
    camera_path: key frames of v, each of length D. hard_frames: the test frames, likewise.
    scene_hash: hash of the contents of all files that the scene consists of.
    rendered_hash: hash of what decides its pixels: without test frames, camera path, number of
        samples and comments.
    """

    name: str
    document: SceneFile
    samples_per_pixel: int
    max_depth: int
    bounds: tuple[Vector, Vector]
    variables: tuple[Variable, ...]
    camera_path: tuple[Vector, ...]
    hard_frames: tuple[Vector, ...]
    scene_hash: str
    rendered_hash: str

    @property
    def dimensions(self) -> int:
        """D, the number of components of v."""
        return len(self.component_names)

    @cached_property
    def component_names(self) -> tuple[str, ...]:
        """The names of the D components of v, in order, for example 'sphere.translation.x'."""
        return component_names(self.variables)

    def values(self, scene_vector: ArrayLike) -> list[NDArray[np.float64]]:
        """The value of every variable at v [D], in the scene's units.

        Raises ValueError, naming the component, for a v that is not [D] numbers in [0, 1].
        """
        v = self._checked(scene_vector)
        return [variable.value(v[part]) for variable, part in self.parts()]

    def parts(self) -> Iterator[tuple[Variable, slice]]:
        """Every variable and its components of v."""
        start = 0
        for variable in self.variables:
            count = len(variable.components)
            yield variable, slice(start, start + count)
            start += count

    def with_first_materials(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same v [D] with no material exchanged, which is slow and moves nothing."""
        changed = v.copy()
        for variable, part in self.parts():
            if isinstance(variable, Material):
                changed[part] = 0
        return changed

    def hidden(self, scene_vector: ArrayLike) -> frozenset[str]:
        """Ids of the objects that are not there at v [D]."""
        hidden: set[str] = set()
        for variable, value in zip(self.variables, self.values(scene_vector), strict=True):
            if isinstance(variable, Visibility) and not value[0]:
                hidden.update(variable.objects)
            elif isinstance(variable, Shape):
                hidden.update(set(variable.choices) - {variable.choices[int(value[0])]})
        return frozenset(hidden)

    @property
    def camera_part(self) -> slice:
        """The components of v that place the camera; empty where none does."""
        return slice(0, 0) if self._view is None else self._view[1]

    def cameras(self, scene_vectors: ArrayLike) -> NDArray[np.float64]:
        """[n, 6], for v [n, D]: origin of the camera, in units of `bounds`, and unit direction.

        Zeros where no variable places the camera.
        """
        vectors = np.asarray(scene_vectors, dtype=np.float64)
        if self._view is None:
            return np.zeros((len(vectors), 6))
        variable, part = self._view
        views = np.array([variable.value(v[part]) for v in vectors]).reshape(-1, 6)
        origin, direction = views[:, :3], views[:, 3:] - views[:, :3]
        low, high = np.array(self.bounds)
        direction[(direction == 0).all(axis=1)] = 0, 0, 1  # as `look_at` has it
        length = np.linalg.norm(direction, axis=1, keepdims=True)
        return np.hstack([(origin - low) / (high - low), direction / length])

    def camera_to_world(self, scene_vector: ArrayLike) -> Matrix | None:
        """[4, 4]: the camera's placement at v [D]; None where no variable says what it looks at."""
        if self._view is None:
            return None
        variable, part = self._view
        view = variable.value(np.asarray(scene_vector, dtype=np.float64)[part])
        return look_at(view[:3], view[3:], np.array(variable.up))

    def field_of_view(self, scene_vector: ArrayLike) -> float | None:
        """Degrees that the camera sees across at v [D]; None where no variable says it."""
        for variable, part in self.parts():
            if isinstance(variable, FieldOfView):
                return float(variable.value(np.asarray(scene_vector, dtype=np.float64)[part])[0])
        return None

    @cached_property
    def _view(self) -> tuple[LookAt | CameraPath, slice] | None:
        """The variable whose value is the camera's origin and target, and its components of v."""
        for variable, part in self.parts():
            if isinstance(variable, LookAt | CameraPath):
                return variable, part
        return None

    def _checked(self, scene_vector: ArrayLike) -> NDArray[np.float64]:
        v = np.asarray(scene_vector, dtype=np.float64)
        names = self.component_names
        if v.shape != (len(names),):
            shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
            raise ValueError(
                f"scene vector of shape {list(v.shape)}: {self.name} has {len(names)} variables, "
                f"{shown}"
            )
        inside = (v >= 0) & (v <= 1)  # NaN is outside too
        if not inside.all():
            first = int(np.argmin(inside))
            raise ValueError(
                f"scene vector: component '{names[first]}' is {v[first]}, expected 0 to 1"
            )
        return v


def component_names(variables: tuple[Variable, ...]) -> tuple[str, ...]:
    """Object, kind and number; a second rotation of an object is its 'rotation_2'."""
    stems = [f"{'+'.join(variable.objects)}.{variable.kind}" for variable in variables]
    for i in reversed(range(len(stems))):
        if earlier := stems[:i].count(stems[i]):
            stems[i] += f"_{earlier + 1}"
    return tuple(
        ".".join(filter(None, (stem, component)))
        for stem, variable in zip(stems, variables, strict=True)
        for component in variable.components
    )


HARD_FRAMES, PATH_FRAMES = 10, 6


def spread_frames(count: int, dimensions: int) -> tuple[Vector, ...]:
    """Points of v spread evenly over the hypercube: a Halton sequence, always the same."""
    from scipy.stats import qmc  # half a second that scenes which name their frames need not wait

    points = qmc.Halton(dimensions, seed=2022).random(count)
    return tuple(tuple(point) for point in points.round(4).tolist())
