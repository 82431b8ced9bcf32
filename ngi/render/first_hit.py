"""The first-intersection buffers (paper, Sec. 4.2): what one camera ray sees before any bounce."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ngi.backend import dr, mi
from ngi.patches import BUFFER_CHANNELS, BufferLayout
from ngi.render.materials import Material, collect_materials, evaluate_materials
from ngi.scene.variable_scene import VariableScene


@dataclass(frozen=True)
class FirstHit:
    """Computes the channels of `BufferLayout` for camera rays, but emission as linear radiance.

    The caller averages over the rays of a pixel and only then takes log1p of the emission, as it
    does with the radiance, so that both agree where a pixel shows nothing but an emitter.
    """

    layout: BufferLayout
    materials: list[Material]
    bounds: tuple[tuple[float, ...], tuple[float, ...]]

    def channels(self, scene: mi.Scene, ray: mi.Ray3f) -> list[mi.Float]:
        """One value per channel and ray; a ray that misses gives zeros, but the environment's
        emission.
        """
        hit = scene.ray_intersect(ray)
        valid = hit.is_valid()
        low, high = map(np.array, self.bounds)
        extent = high - low
        albedo, roughness = evaluate_materials(self.materials, hit, valid)
        buffers = {
            "position": (hit.p - mi.Vector3f(*low.tolist())) / mi.Vector3f(*extent.tolist()),
            "normal": hit.sh_frame.n * 0.5 + 0.5,
            "outgoing": -ray.d,
            "albedo": albedo,
            "roughness": [roughness],
        }
        channels = []
        for name in self.layout.names:
            if name == "emission":
                channels += _emission(scene, hit)
            else:
                channels += [dr.select(valid, c, mi.Float(0)) for c in buffers[name]]
        return channels


def first_hit_of(scene: VariableScene) -> FirstHit:
    """The first-hit buffers that a scene needs; ValueError for a BSDF of an unknown kind."""
    materials = collect_materials(scene.bsdfs())
    return FirstHit(
        layout=_needed_buffers(scene, materials),
        materials=materials,
        bounds=scene.description.bounds,
    )


def _needed_buffers(scene: VariableScene, materials: list[Material]) -> BufferLayout:
    """All buffers but those that can only be constant.

    Roughness: constant where every BSDF has the same one and no variable changes it. Emission:
    constant zero where no shape emits and there is no environment.
    """
    left_out = set()
    varied = {name for variable in scene.description.variables for name in variable.affects}
    roughness = {material.constant_roughness for material in materials}
    if len(roughness) == 1 and None not in roughness and "roughness" not in varied:
        left_out.add("roughness")
    if not any(shape.is_emitter() for shape in scene.shapes) and not scene.scene.environment():
        left_out.add("emission")
    return BufferLayout(tuple(name for name in BUFFER_CHANNELS if name not in left_out))


def _emission(scene: mi.Scene, hit: mi.SurfaceInteraction3f) -> list[mi.Float]:
    """Linear radiance emitted towards the camera, the environment's where the ray misses."""
    emitter = hit.emitter(scene)
    if emitter is None:  # in a scalar variant
        return [mi.Float(0)] * 3
    return list(mi.Color3f(emitter.eval(hit)))
