"""What a scene needs of the first-hit buffers: the rest is not rendered, stored or fed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ngi.machine.backend import mi
from ngi.patches import BufferLayout
from ngi.render.materials import Material
from ngi.scene.variable_scene import VariableScene

_NEVER_SAMPLED = {"DirectionalArea"}
"""Emitters in one direction from an area, which Mitsuba's path tracer never meets."""


@dataclass(frozen=True)
class BufferNeed:
    """Whether a scene carries a buffer, and why (not)."""

    buffer: str
    needed: bool
    why: str


def buffer_needs(scene: VariableScene, materials: list[Material]) -> list[BufferNeed]:
    """For every buffer of the paper whether it can tell the network anything in this scene.

    A buffer is left out if it is constant over the whole image and the whole hypercube.
    """
    return [
        BufferNeed("position", True, "the network's first layers see it alone"),
        BufferNeed("normal", True, "surfaces differ in it"),
        BufferNeed("outgoing", True, "it differs from pixel to pixel"),
        _of_materials(scene, "albedo", {m.constant_albedo for m in materials}),
        _of_materials(scene, "roughness", {m.constant_roughness for m in materials}),
        _emission(scene),
    ]


def direct_need(scene: VariableScene) -> BufferNeed:
    """Whether there is direct light to trace, where that is asked for."""
    if all(emitter.class_name() in _NEVER_SAMPLED for emitter in scene.scene.emitters()):
        return BufferNeed("direct", False, "nothing emits that a path could reach")
    if 0 <= scene.description.max_depth < 2:
        return BufferNeed("direct", False, "the scene's paths end at the first surface")
    if not scene.bsdfs():
        return BufferNeed("direct", False, "there is no surface")
    return BufferNeed("direct", True, "emitters light the surfaces")


def needed_layout(needs: list[BufferNeed]) -> BufferLayout:
    return BufferLayout(tuple(need.buffer for need in needs if need.needed))


def buffers_are_static(scene: VariableScene, layout: BufferLayout) -> bool:
    """Whether these buffers of a pixel are the same for every v.

    Direct light differs with whatever varies.
    """
    if "direct" in layout.names and scene.description.variables:
        return False
    return not scene.affected & {"camera", "position", *layout.names}


def _of_materials(scene: VariableScene, buffer: str, constants: set[object]) -> BufferNeed:
    """constants: of every BSDF the value that the buffer has everywhere on it, or None."""
    if buffer in scene.affected:
        return BufferNeed(buffer, True, "a variable changes it")
    if len(constants) > 1 or None in constants:
        return BufferNeed(buffer, True, "surfaces differ in it")
    where = f"it is {constants.pop()} everywhere" if constants else "there is no surface"
    return BufferNeed(buffer, False, where)


def _emission(scene: VariableScene) -> BufferNeed:
    emitting = [shape for shape in scene.shapes if shape.is_emitter()]
    if scene.scene.environment() is not None:
        return BufferNeed("emission", True, "the environment emits")
    if not emitting:
        return BufferNeed("emission", False, "no surface emits")
    if "camera" in scene.affected:
        return BufferNeed("emission", True, "the camera moves and could see an emitter")
    still = [shape for shape in emitting if shape.id() not in scene.moving]
    if len(still) == len(emitting) and not any(_in_view(scene.scene, s) for s in still):
        return BufferNeed("emission", False, "all emitters lie outside of the camera's view")
    return BufferNeed("emission", True, "an emitter may be in view")


def _in_view(scene: mi.Scene, shape: mi.Shape) -> bool:
    """Whether the shape's box reaches into the view of the perspective camera."""
    sensor = mi.traverse(scene.sensors()[0])
    corners = np.array(
        [[float(np.ravel(shape.bbox().corner(i)[axis])[0]) for axis in range(3)] for i in range(8)]
    )
    to_world = np.array(sensor["to_world"].matrix, dtype=np.float64).reshape(4, 4)
    x, y, z = np.linalg.inv(to_world)[:3] @ np.column_stack([corners, np.ones(8)]).T
    shift_x, shift_y = (
        abs(float(np.ravel(sensor[f"principal_point_offset_{axis}"])[0])) for axis in "xy"
    )
    half = np.tan(np.radians(float(np.ravel(sensor["x_fov"])[0])) / 2)
    wide, high = half * (1 + 2 * shift_x), half * (1 + 2 * shift_y)
    planes = [z, wide * z - x, wide * z + x, high * z - y, high * z + y]
    return not any((distance < 0).all() for distance in planes)
