"""A scene as an argument of functions whose kernel launches Dr.Jit records and replays."""

from __future__ import annotations

from typing import Any

from ngi.machine.backend import mi
from ngi.scene.jit_variables import variables_of
from ngi.scene.variable_scene import VariableScene


class RecordedScene:
    """What kernels read of a scene, without what is there many times.

    Dr.Jit goes through the arguments of a recorded function at every call. In Mitsuba's scene it
    meets what shapes share as often as there are shapes, and all of it again by its registry: of
    living-room 9,607 numbers, 823 of them different, which takes longer than to trace 256 rays.
    """

    def __init__(self, scene: VariableScene) -> None:
        self._scene = scene
        self._own: list[mi.UInt64] = []
        self._own_of: int | None = None

    def whole(self) -> mi.Scene:
        """The scene itself, in which there is everything."""
        return self._scene.scene

    def parts(self) -> list[Any]:
        """What is reached from shapes, emitters, the camera and the BSDFs that variables choose
        from, and what the scene holds besides.

        Where it has to be built anew whenever something moves, as on CUDA, it is all of the scene.
        """
        rebuilds = self._scene.rebuilds
        if rebuilds is None:
            return [self.whole()]
        scene = self._scene.scene
        shapes, camera, choices = list(scene.shapes()), scene.sensors()[0], self._scene.choices
        if self._own_of != rebuilds:
            parts = [*shapes, *scene.emitters(), camera, *choices]
            self._own = _own(scene, [*parts, *self._scene.changing])
            self._own_of = rebuilds
        return [self._own, scene.emitters_dr(), shapes, camera, choices]


def _own(scene: mi.Scene, parts: list[mi.Object]) -> list[mi.UInt64]:
    """Variables of a scene that are none of these parts', each once: they stay what they are.

    Where all shapes, emitters and sensors are listed, Dr.Jit would go through each of them.
    """
    elsewhere = {variable.index for part in parts for variable in variables_of(part)}
    lists = (scene.shapes_dr(), scene.emitters_dr(), scene.sensors_dr())
    elsewhere |= {each.index for each in lists}
    by_index = {variable.index: variable for variable in variables_of(scene)}
    return [variable for index, variable in by_index.items() if index not in elsewhere]
