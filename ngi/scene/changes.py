"""Tells the objects of a loaded scene that their parameters were written."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import dr, mi
from ngi.scene.acceleration import EmbreeScene
from ngi.scene.jit_variables import evaluate

GEOMETRY = frozenset({"to_world", "vertex_positions", "vertex_normals"})
"""Parameters of a shape that say where it is."""


class Changes:
    """As `mi.SceneParameters.update`, but shapes that moved are moved in the acceleration
    structure, where that is possible, instead of having all of it built again.
    """

    def __init__(self, scene: mi.Scene, parameters: mi.SceneParameters) -> None:
        self._scene = scene
        self._parameters = parameters
        self._structure = EmbreeScene.of(scene)
        self._to_world: dict[mi.Object, NDArray[np.float64]] = {}
        self.rebuilds = None if self._structure is None else 0
        """How often all of it was built; None where every change does so."""

    def place(self, node: mi.Object, to_world: NDArray[np.float64]) -> None:
        """Takes note of the to_world [4, 4] that was written to an object."""
        self._to_world[node] = to_world

    def tell(self) -> None:
        """Tells the objects that were written, and what they are part of, deepest first."""
        written = self._parameters.nodes_to_update
        moved = [
            node
            for (_, node), names in written.items()
            if isinstance(node, mi.Shape) and not GEOMETRY.isdisjoint(names)
        ]
        bitmaps = [node for _, node in written if node.class_name().startswith("BitmapTexture")]
        if self._structure is None or any(shape not in self._structure for shape in moved):
            self._parameters.update()
            if self.rebuilds is not None:
                self.rebuilds += 1
        else:
            self._tell_all_but_the_scene()
            if moved:
                self._structure.move({shape: self._to_world.get(shape) for shape in moved})
        if not mi.variant().startswith("scalar"):
            evaluate(bitmaps)

    def _tell_all_but_the_scene(self) -> None:
        """The scene itself would build the acceleration structure."""
        written = self._parameters.nodes_to_update
        for (_, node), names in sorted(written.items(), key=lambda entry: -entry[0][0]):
            if node != self._scene:
                node.parameters_changed(list(names))
        written.clear()
        self._parameters.update_candidates.clear()
        dr.eval()
