"""Specular bounces traced in the buffers: what a mirror or a window shows (paper, Fig. 10).

"When ray tracing hardware is available our method benefits by tracing all specular bounces during
the buffer generation": the network then learns the non-specular shading of what is seen there. A
camera ray goes on in one direction, the one that most of the light comes from; Mitsuba's own path
tracer would choose one at random. In the other direction only emitters are looked for: the lamp
that a sheet of glass mirrors beside what it lets through.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ngi.machine.backend import dr, mi
from ngi.render.bounces import Branch, SpecularSurface, specular_surface
from ngi.render.direct_light import emission
from ngi.render.materials import Material, collect_materials, has_bsdf
from ngi.scene.kinds import Roughness
from ngi.scene.variable_scene import VariableScene

SPECULAR_ROUGHNESS = 0.05
"""Alpha up to which a conductor or dielectric is followed, in its mean direction."""

MAX_SPECULAR_BOUNCES = 12
"""After so many bounces the last hit counts, whatever it is."""


@dataclass(frozen=True)
class ChainEnd:
    """Where specular bounces have led.

    ray: the last segment.
    hit: what it meets, or nothing.
    throughput: product of the weights of the bounces, 1 where there was none.
    roughness: sqrt(sum of alpha^2) over the bounces.
    emission: linear radiance of every emitter on the way, the environment included, times the
        throughput up to it; with direct light, of those in the other directions too.
    blurred: with direct light, what a rough surface on the way shows of them, in place of emission:
        as sharp as if it were smooth.
    segments: of the path so far, one more than there were bounces.
    """

    ray: mi.Ray3f
    hit: mi.SurfaceInteraction3f
    throughput: mi.Color3f
    roughness: mi.Float
    emission: mi.Color3f
    blurred: mi.Color3f
    segments: mi.UInt32


@dataclass(frozen=True)
class SpecularChain:
    """Follows camera rays through the specular surfaces of a scene.

    surfaces: at least one. maximum_bounces: at least 1. longest_path: the scene's max_depth.
    buffers: those that the scene carries because of them. Once there are bounces, the position
        does not tell the outgoing direction any more, nor does the camera's view what is seen.
    direct: whether direct light is traced too. Emitters are then looked for in the directions that
        are not followed as well.
    photons: whether it is a photon's flux that is carried on, in place of radiance.
    """

    surfaces: list[SpecularSurface]
    maximum_bounces: int
    longest_path: int
    buffers: tuple[str, ...]
    direct: bool
    photons: bool = False

    def follow(self, scene: mi.Scene, ray: mi.Ray3f, active: bool | mi.Bool = True) -> ChainEnd:
        """A loop in the kernel, or in Python where the variant is scalar.

        active: rays that are not meet nothing.

        No ray is intersected twice: the loop hands on where it meets something, and at what.
        """

        def step(
            ray: mi.Ray3f,
            met: mi.PreliminaryIntersection3f,
            throughput: mi.Color3f,
            variance: mi.Float,
            light: tuple[mi.Color3f, mi.Color3f],
            bounces: mi.UInt32,
            active: mi.Bool,
        ) -> tuple[Any, ...]:
            hit = met.compute_surface_interaction(ray, mi.RayFlags.All, active)
            light = self._added(light, throughput * emission(scene, hit), variance > 0)
            active = active & hit.is_valid() & (bounces < self.maximum_bounces)
            goes_on, (direction, weight), other, alpha = self._bounce(hit, active)
            if self.direct and any(surface.branches == 2 for surface in self.surfaces):
                beside = throughput * _emission_along(other, scene, hit, goes_on)
                light = self._added(light, beside, variance + alpha > 0)
            ray = dr.select(goes_on, hit.spawn_ray(hit.to_world(direction)), ray)
            return (
                ray,
                dr.select(goes_on, scene.ray_intersect_preliminary(ray, False, goes_on), met),
                dr.select(goes_on, throughput * weight, throughput),
                dr.select(goes_on, variance + dr.square(alpha), variance),
                light,
                bounces + 1,
                goes_on,
            )

        ray, met, throughput, variance, light, segments, _ = dr.while_loop(
            state=(
                mi.Ray3f(ray),
                scene.ray_intersect_preliminary(ray, True, active),
                mi.Color3f(1),
                mi.Float(0),
                (mi.Color3f(0), mi.Color3f(0)),
                mi.UInt32(0),
                mi.Bool(active),
            ),
            cond=lambda *state: state[-1],
            body=step,
        )
        hit = met.compute_surface_interaction(ray)
        return ChainEnd(ray, hit, throughput, dr.sqrt(variance), light[0], light[1], segments)

    def lit(self, segments: mi.UInt32) -> mi.Bool:
        """Whether the scene's paths are long enough to bring an emitter's light over one more."""
        return mi.Bool(True) if self.longest_path < 0 else segments < self.longest_path

    def _added(
        self, light: tuple[mi.Color3f, mi.Color3f], more: mi.Color3f, rough: mi.Bool
    ) -> tuple[mi.Color3f, mi.Color3f]:
        """`ChainEnd.emission` and `blurred` so far, and more of them.

        rough: whether a rough surface shows it
        """
        sharp, blurred = light
        if not self.direct:
            return sharp + more, blurred
        return sharp + dr.select(rough, 0, more), blurred + dr.select(rough, more, 0)

    def _bounce(
        self, hit: mi.SurfaceInteraction3f, active: mi.Bool
    ) -> tuple[mi.Bool, Branch, Branch, mi.Float]:
        """Whether the ray goes on, the branch that it follows, the other one, and alpha."""
        goes_on, alpha = mi.Bool(False), mi.Float(0)
        followed, other = ((mi.Vector3f(0, 0, 1), mi.Color3f(0)) for _ in range(2))
        for surface in self.surfaces:
            here = active & has_bsdf(hit, surface.material.bsdf, active)
            if not surface.two_sided:
                here = here & (mi.Frame3f.cos_theta(hit.wi) > 0)
            roughness = surface.material.roughness(hit, here)
            here = here & (roughness <= SPECULAR_ROUGHNESS)
            stronger, weaker = surface.bounce(hit, here, self.photons)
            goes_on = goes_on | here
            followed = dr.select(here, stronger, followed)
            other = dr.select(here, weaker, other)
            alpha = dr.select(here, roughness, alpha)
        return goes_on, followed, other, alpha


def _emission_along(
    branch: Branch, scene: mi.Scene, hit: mi.SurfaceInteraction3f, active: mi.Bool
) -> mi.Color3f:
    """Linear radiance of the emitter that is seen there from a hit, times the branch's weight."""
    direction, weight = branch
    active = active & (dr.max(weight) > 0)
    return weight * emission(
        scene, scene.ray_intersect(hit.spawn_ray(hit.to_world(direction)), active)
    )


def _smoothest(scene: VariableScene) -> NDArray[np.float64]:
    """[D]: v with every roughness at its least, which in releases may be where the range ends."""
    v = np.zeros(scene.description.dimensions)
    for variable, part in scene.description.parts():
        if isinstance(variable, Roughness):
            v[part] = variable.maximum < variable.minimum
    return v


def specular_chain(
    scene: VariableScene, materials: list[Material], *, direct: bool
) -> SpecularChain | None:
    """The chains of a scene, or None where nothing in it is specular at any v.

    No longer than the scene's paths: what lies beyond them emits nothing in its pictures. Leaves
    the scene where it is smoothest.

    direct: see `SpecularChain`.
    """
    scene.apply(_smoothest(scene))
    fronts = [material.front for material in materials]
    lowest = [m.front.constant_roughness for m in collect_materials([m.bsdf for m in fronts])]
    surfaces = [
        surface
        for front, roughness in zip(fronts, lowest, strict=True)
        if (roughness is None or roughness <= SPECULAR_ROUGHNESS)
        and (surface := specular_surface(front)) is not None
    ]
    bounces, longest_path = MAX_SPECULAR_BOUNCES, scene.description.max_depth
    if longest_path >= 0:  # -1: no limit
        bounces = min(bounces, longest_path - 1)
    if not surfaces or bounces < 1:
        return None
    buffers = ["outgoing", "throughput"]
    if any(surface.material.constant_roughness != 0 for surface in surfaces):
        buffers.append("chain_roughness")
    if scene.scene.environment() or any(shape.is_emitter() for shape in scene.shapes):
        buffers.append("emission")
    return SpecularChain(surfaces, bounces, longest_path, tuple(buffers), direct)
