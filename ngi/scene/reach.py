"""How far away something may be and still cast a shadow of a sun or a sky."""

from __future__ import annotations

import numpy as np

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
        self._low, self._high = np.minimum(low, bounds[0]), np.maximum(high, bounds[1])

    def extend(self) -> None:
        """Makes these rays as long as they have to be, after loading and whenever Mitsuba has
        built the scene anew, which takes it back.
        """
        if not self._emitters:
            return
        middle, half = (self._low + self._high) / 2, (self._high - self._low) / 2
        place = mi.ScalarTransform4f().translate(middle.tolist()).scale(half.tolist())
        box = mi.load_dict({"type": "scene", "box": {"type": "cube", "to_world": place}})
        for emitter in self._emitters:
            emitter.set_scene(box)
