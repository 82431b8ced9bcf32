"""A Mitsuba scene whose variables are set by the scene vector v, mutated in place."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.backend import mi
from ngi.scene.description import SceneDescription
from ngi.scene.kinds import Material
from ngi.scene.loading import load
from ngi.scene.scene_parameters import SceneParameters


class VariableScene:
    """A loaded scene at some v; loaded once per process, since loading in a loop leaks memory.

    The Mitsuba variant that is active at construction must be active at every later call. Raises
    ValueError where scene.yaml names an object or property that scene.xml does not have.
    """

    def __init__(self, description: SceneDescription) -> None:
        self.description = description
        self.scene: mi.Scene = load(description.document)
        self._parameters = SceneParameters(
            self.scene,
            scene_file=description.document.path,
            size=float(np.linalg.norm(np.subtract(*description.bounds))),
        )
        self.shapes: list[mi.Shape] = self._parameters.objects(mi.Shape)
        self._writes = [variable.bind(self._parameters) for variable in description.variables]
        self._parameters.forget_the_rest()
        self._values: list[NDArray[np.float64] | None] = [None] * len(self._writes)

    def bsdfs(self) -> list[mi.BSDF]:
        """Every BSDF that a ray can hit at some v."""
        shapes = [s for s in self.shapes if s.class_name() not in ("Instance", "ShapeGroup")]
        chosen = [
            self._parameters.object(name)
            for variable in self.description.variables
            if isinstance(variable, Material)
            for name in variable.choices
        ]
        bsdfs: list[mi.BSDF] = []
        for bsdf in [shape.bsdf() for shape in shapes] + chosen:
            if bsdf not in bsdfs:
                bsdfs.append(bsdf)
        return bsdfs

    def apply(self, scene_vector: ArrayLike) -> None:
        """Sets the scene to v of shape [D] in [0, 1]; ValueError for any other v.

        Only what changed since the last v is written, so that an unmoved shape is never rebuilt.
        """
        values = self.description.values(scene_vector)
        changed = False
        for i, (write, value) in enumerate(zip(self._writes, values, strict=True)):
            present = self._values[i]
            if present is None or not np.array_equal(present, value):
                write(value)
                self._values[i] = value
                changed = True
        if changed:
            self._parameters.update()
