"""Tracing without a JIT compiler: Mitsuba's scalar variant, for machines without a good LLVM."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np
import torch
from numpy.typing import NDArray

from ngi.machine.backend import mi
from ngi.render.direct_light import emitter_probabilities, light_points
from ngi.render.first_hit import FirstHit
from ngi.render.tracing import Pending, PixelList, Pixels, Tracer, Window, subpixel_points


class ScalarTracer(Tracer):
    """The `ngi.render.tracing.Tracer` of scalar_rgb.

    Radiance comes from Mitsuba's own compiled rendering loop, over the crop window of a copy of the
    scene's camera with a box filter. The copy follows the camera's place and field of view. The
    buffers come from a Python loop over pixels, so that only few samples are affordable.
    """

    def __init__(self, *, scene: mi.Scene, first_hit: FirstHit) -> None:
        self._scene = scene
        self._first_hit = first_hit
        self._sensor = _box_filtered_copy(scene.sensors()[0])
        self._copy = mi.traverse(self._sensor)

    def radiance(self, window: Window, *, samples: int, seed: int) -> Pending:
        # A film given a new size takes all of it as its crop window, but keeps the old offset.
        self._copy["film.size"] = [window.resolution, window.resolution]
        self._copy["film.crop_offset"] = [0, 0]
        self._copy.update()
        self._copy["film.crop_size"] = [window.width, window.height]
        self._copy["film.crop_offset"] = [window.x, window.y]
        camera = mi.traverse(self._scene.sensors()[0])
        for key in ("to_world", "x_fov"):
            self._copy[key] = camera[key]
        self._copy.update()
        image = mi.render(self._scene, sensor=self._sensor, seed=seed, spp=samples)
        colours = np.array(image, dtype=np.float32)[..., :3]  # an `aov` adds its buffers
        result = torch.from_numpy(colours)
        return lambda: result

    def buffers(self, pixels: Pixels, *, samples: int) -> Pending:
        emitters = emitter_probabilities(self._scene)
        points, lights = subpixel_points(samples), light_points(samples, emitters).tolist()
        means = [
            self._pixel(points, lights, x, y, pixels.resolution) for y, x in _coordinates(pixels)
        ]
        numbers = np.array(means, dtype=np.float32).reshape(*pixels.shape, -1)
        result = torch.from_numpy(numbers)
        return lambda: result

    def _pixel(
        self,
        points: NDArray[np.float64],
        lights: list[list[float]],
        x: int,
        y: int,
        resolution: int,
    ) -> NDArray[np.float64]:
        """points, lights: [n, 2] and [n, 6], of `subpixel_points` and `light_points`"""
        sensor = self._scene.sensors()[0]
        samples: list[list[mi.Float]] = []
        for point, light_point in zip(
            (points + np.array([x, y])) / resolution, lights, strict=True
        ):
            ray, _ = sensor.sample_ray(0, 0, mi.Point2f(point), mi.Point2f(0.5))
            samples.append(self._first_hit.channels(self._scene, ray, light_point))
        mean: NDArray[np.float64] = np.mean(np.array(samples, dtype=np.float64), axis=0)
        return mean


def _coordinates(pixels: Pixels) -> Iterable[tuple[int, int]]:
    """Row and column of each."""
    if isinstance(pixels, PixelList):
        return (divmod(number, pixels.resolution) for number in pixels.numbers.tolist())
    rows = range(pixels.y, pixels.y + pixels.height)
    return product(rows, range(pixels.x, pixels.x + pixels.width))


def _box_filtered_copy(sensor: mi.Sensor) -> mi.Sensor:
    """The scene's perspective camera with a film of our own."""
    parameters = mi.traverse(sensor)
    return mi.load_dict(
        {
            "type": "perspective",
            "fov": parameters["x_fov"],
            "fov_axis": "x",
            "near_clip": parameters["near_clip"],
            "far_clip": parameters["far_clip"],
            "principal_point_offset_x": parameters["principal_point_offset_x"],
            "principal_point_offset_y": parameters["principal_point_offset_y"],
            "to_world": parameters["to_world"],
            "film": {
                "type": "hdrfilm",
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        }
    )
