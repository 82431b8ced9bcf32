"""A Mitsuba scene whose variables are set by the scene vector v, mutated in place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.backend import mi
from ngi.scene.description import SceneDescription
from ngi.scene.properties import PROPERTIES
from ngi.scene.scene_parameters import SceneParameters
from ngi.scene.variables import variable_values


class VariableScene:
    """A loaded scene at some v; loaded once per process, since loading in a loop leaks memory.

    The Mitsuba variant that is active at construction must be active at every later call. Raises
    ValueError where scene.yaml names an object or property that scene.xml does not have.
    """

    def __init__(self, description: SceneDescription) -> None:
        self.description = description
        # Optimising would merge meshes that share a BSDF, and their ids would be lost.
        self.scene: mi.Scene = mi.load_file(str(description.scene_file), optimize=False)
        self._parameters = SceneParameters(self.scene, scene_file=description.scene_file)
        self.shapes: list[mi.Shape] = self._parameters.objects(mi.Shape)
        self._writes = [
            PROPERTIES[variable.property].bind(self._parameters, variable.object, variable.axes)
            for variable in description.variables
        ]
        self._parameters.forget_the_rest()
        self._values: list[NDArray[np.float64] | None] = [None] * len(self._writes)

    def apply(self, scene_vector: ArrayLike) -> None:
        """Sets the scene to v of shape [D] in [0, 1]; ValueError for any other v.

        Only what changed since the last v is written, so that an unmoved shape is never rebuilt.
        """
        values = variable_values(self.description.variables, scene_vector)
        changed = False
        for i, (write, value) in enumerate(zip(self._writes, values, strict=True)):
            present = self._values[i]
            if present is None or not np.array_equal(present, value):
                write(value)
                self._values[i] = value
                changed = True
        if changed:
            self._parameters.update()
