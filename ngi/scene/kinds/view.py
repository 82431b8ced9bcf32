"""Variables of the camera, and of where the sun stands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ngi.scene import transforms
from ngi.scene.variable import LoadedScene, RangedVariable, Values, Variable, Write
from ngi.scene.yaml_keys import Vector, YamlKeys

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

VIEW = ("origin_x", "origin_y", "origin_z", "target_x", "target_y", "target_z")
UP = (0.0, 1.0, 0.0)

CAMERAS = ("PerspectiveCamera",)
DIRECTED = ("DirectionalEmitter", "SpotLight", "Projector")
"""Classes of Mitsuba's."""


@dataclass(frozen=True)
class LookAt(RangedVariable):
    """Where the camera stands and the point it looks at (release: five of the six vary).

    up: the direction that is up in the image.
    """

    up: Vector = UP

    kind = "look_at"
    affects = frozenset({"camera"})
    numbers = VIEW

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        return _looking(scene, object_id, self.up)

    @classmethod
    def read_options(cls, objects: tuple[str, ...], keys: YamlKeys) -> dict[str, Any]:  # noqa: ARG003
        if "up" not in keys:
            return {"up": UP}
        up = keys.numbers("up", length=3)
        if not any(up):
            raise keys.error("up", list(up), "give a direction, such as [0, 1, 0]")
        return {"up": up}


@dataclass(frozen=True)
class CameraPath(Variable):
    """A camera on a smooth path through key positions: one component of v for all of it.

    keys: [origin x, y, z, target x, y, z] for equally spaced components from 0 to 1, joined by a
    cubic spline. up: as in `LookAt`.
    """

    keys: tuple[Vector, ...]
    up: Vector = UP

    kind = "camera_path"
    affects = frozenset({"camera"})

    @property
    def range(self) -> str:
        return f"{len(self.keys)} views"

    def value(self, components: Values) -> Values:
        """[6]: the view there."""
        view: Values = self._spline(components[0])
        return view

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline  # a quarter of a second, for few scenes

        return CubicSpline(np.linspace(0, 1, len(self.keys)), np.array(self.keys))

    def bind(self, scene: LoadedScene) -> Write:
        return _looking(scene, self.objects[0], self.up)

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        if len(objects) != 1:
            raise keys.error("object", list(objects), "a path belongs to one camera")
        views = keys.vectors("keys", length=6)
        if len(views) < 2:
            raise keys.error("keys", len(views), "give at least two views")
        return cls(objects, views, **LookAt.read_options(objects, keys))


@dataclass(frozen=True)
class Direction(RangedVariable):
    """Where the light of a sun, a spot or a projector comes from, in degrees, with y up.

    azimuth: 0 is +z and 90 is +x. elevation: 0 is the horizon and 90 the zenith. A spot or
    projector stays where it is.
    """

    kind = "direction"
    numbers = ("azimuth", "elevation")
    unit = "degrees"
    limits = (-360.0, 360.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        placement = scene.placement(object_id, only=DIRECTED)
        place = transforms.translation(placement.origin)

        def write(angles: Values) -> None:
            azimuth, elevation = np.radians(angles)
            towards = np.array(
                [
                    np.sin(azimuth) * np.cos(elevation),
                    np.sin(elevation),
                    np.cos(azimuth) * np.cos(elevation),
                ]
            )
            placement.place(place @ transforms.look_at(np.zeros(3), -towards, np.array(UP)))

        return write


def _looking(scene: LoadedScene, camera: str, up: Vector) -> Write:
    """A function that places a camera by origin and target, [6]."""
    placement = scene.placement(camera, only=CAMERAS)
    as_authored = transforms.mirroring(placement.mirrors)

    def write(view: Values) -> None:
        placement.place(transforms.look_at(view[:3], view[3:], np.array(up)) @ as_authored)

    return write
