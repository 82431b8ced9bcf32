"""How far away something may be and still cast a shadow of a sun or a sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import mi
from ngi.scene.scene_parameters import is_infinite


class Reach:
    """Mitsuba's rays towards what is infinitely far away end where they have crossed the sphere
    about the scene as it was loaded, before what has moved far out of it.

    bounds: what everything stays in. Where the scene is as large across, nothing is changed.
    """

    def __init__(
        self, scene: mi.Scene, bounds: tuple[tuple[float, ...], tuple[float, ...]]
    ) -> None:
        low, high = (np.ravel(corner) for corner in (scene.bbox().min, scene.bbox().max))
        within = np.linalg.norm(np.subtract(*bounds)) <= np.linalg.norm(high - low)
        self._emitters = [e for e in scene.emitters() if not within and is_infinite(e)]
        if self._emitters:  # loaded once: scenes that are loaded again and again leak memory
            self._box = _box(np.minimum(low, bounds[0]), np.maximum(high, bounds[1]))

    def extend(self) -> None:
        """Makes these rays as long as they have to be, after loading and whenever Mitsuba has
        built the scene anew, which takes it back.
        """
        for emitter in self._emitters:
            emitter.set_scene(self._box)


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> mi.Scene:
    """A scene with these corners [3]."""
    place = mi.ScalarTransform4f().translate(((low + high) / 2).tolist())
    place = place.scale(((high - low) / 2).tolist())
    return mi.load_dict({"type": "scene", "box": {"type": "cube", "to_world": place}})
