"""What the benchmark compares patches with: Mitsuba's own tracing, and compiled kernels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import isqrt

import numpy as np

from ngi.backend import dr, mi
from ngi.scene import SceneDescription
from ngi.scene.loading import load


class FixedLaunch:
    """Mitsuba's time for `paths` camera paths: one launch, one configuration, nothing around it.

    scene: traced as authored; the variant must be active.
    paths: number of paths of one launch; paths / samples_per_pixel is a square number.
    """

    def __init__(self, scene: SceneDescription, *, paths: int, samples_per_pixel: int) -> None:
        pixels = isqrt(paths // samples_per_pixel)
        if pixels**2 * samples_per_pixel != paths:
            raise ValueError(f"{paths} paths are no square image at {samples_per_pixel} spp")
        # A scene of its own, which nobody moves.
        self._scene = load(scene.document)
        self._samples = samples_per_pixel
        authored = mi.traverse(self._scene.sensors()[0])
        self._sensor = mi.load_dict(
            {
                "type": "perspective",
                "fov": float(np.ravel(authored["x_fov"])[0]),
                "fov_axis": "x",
                "to_world": mi.ScalarTransform4f(
                    np.array(authored["to_world"].matrix, dtype=float).reshape(4, 4)
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": pixels,
                    "height": pixels,
                    "rfilter": {"type": "box"},
                },
            }
        )

    def trace(self, seed: int) -> None:
        """Traces and waits."""
        image = mi.render(self._scene, sensor=self._sensor, spp=self._samples, seed=seed)
        np.asarray(image)


@contextmanager
def counted_compilations() -> Iterator[list[int]]:
    """Gives a list that holds, after the block, the number of kernels compiled inside it."""
    count = [0]
    if not mi.variant().startswith(("cuda", "llvm")):
        yield count  # the scalar variant compiles nothing
        return
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        yield count
        kernels = dr.kernel_history([dr.KernelType.JIT])
    count[0] = sum(not kernel["cache_hit"] for kernel in kernels)
