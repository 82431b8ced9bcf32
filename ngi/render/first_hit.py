"""The first-intersection buffers (paper, Sec. 4.2): what one camera ray sees before any bounce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ngi.machine.backend import dr, mi
from ngi.patches import BufferLayout
from ngi.render.caustics import Caustics, caustics_of
from ngi.render.direct_light import direct_light, emission
from ngi.render.materials import Material, evaluate_materials, materials_in
from ngi.render.needs import buffer_needs, direct_need, needed_layout
from ngi.render.specular import ChainEnd, SpecularChain, specular_chain
from ngi.scene.variable_scene import VariableScene


@dataclass(frozen=True)
class FirstHit:
    """Computes the channels of `BufferLayout` for camera rays, but radiance linear.

    The caller averages over the rays of a pixel and only then takes log1p of emission and direct
    light, as it does with the radiance, so that they agree where a pixel shows nothing else.
    """

    layout: BufferLayout
    materials: list[Material]
    bounds: tuple[tuple[float, ...], tuple[float, ...]]
    chain: SpecularChain | None
    caustics: Caustics | None

    def channels(
        self,
        scene: mi.Scene,
        ray: mi.Ray3f,
        light_point: Sequence[mi.Float],
        caustics: mi.Float | None = None,
    ) -> list[mi.Float]:
        """One value per channel and ray; a ray that misses gives zeros, but the environment's
        emission and the throughput.

        light_point: what `direct_light` takes; read where the layout has direct light.
        caustics: the pictures of `self.caustics`, whose light is added to the direct light.
        """
        traced: dict[str, list[mi.Float]] = {}
        end = None
        if self.chain is None:
            hit = scene.ray_intersect(ray)
        else:
            end = self.chain.follow(scene, ray)
            ray, hit = end.ray, end.hit
            traced = {
                "throughput": list(end.throughput),
                "chain_roughness": [end.roughness],
                "emission": list(end.emission),
            }
        valid = hit.is_valid()
        if "direct" in self.layout.names:
            traced["direct"] = list(self._direct(scene, hit, end, light_point, caustics))
        albedo, roughness = evaluate_materials(self.materials, hit, valid)
        buffers = {
            "position": self._normalised(hit.p),
            "normal": hit.sh_frame.n * 0.5 + 0.5,
            "outgoing": -ray.d,
            "albedo": albedo,
            "roughness": [roughness],
        }
        channels = []
        for name in self.layout.names:
            if name in traced:
                channels += traced[name]
            elif name == "emission":
                channels += list(emission(scene, hit))
            else:
                channels += [dr.select(valid, c, mi.Float(0)) for c in buffers[name]]
        return channels

    def _direct(
        self,
        scene: mi.Scene,
        hit: mi.SurfaceInteraction3f,
        end: ChainEnd | None,
        light_point: Sequence[mi.Float],
        caustics: mi.Float | None,
    ) -> mi.Color3f:
        """Linear radiance, with what rough surfaces show of emitters: a network can dim it here.

        end: of the chain whose hit it is
        """
        direct = direct_light(scene, hit, light_point)
        fits = self.chain is None or end is None or self.chain.lit(end.segments + 1)
        if self.caustics is not None:
            direct += dr.select(fits, self.caustics.radiance(caustics, hit), 0)
        if self.chain is None or end is None:
            return direct
        lit = self.chain.lit(end.segments)
        return dr.select(lit, end.throughput * direct, 0) + end.blurred

    def _normalised(self, position: mi.Point3f) -> mi.Vector3f:
        """Within the bounds."""
        low, high = map(np.array, self.bounds)
        return (position - mi.Vector3f(*low.tolist())) / mi.Vector3f(*(high - low).tolist())


def first_hit_of(
    scene: VariableScene,
    *,
    needed_only: bool,
    trace_specular: bool,
    trace_direct: bool,
    trace_caustics: bool,
) -> FirstHit:
    """The buffers that a scene needs, or all; ValueError for a BSDF of an unknown kind.

    trace_specular: those of the first hit that is not specular (paper, Fig. 10).
    trace_direct: the direct light too, see `ngi.render.direct_light`.
    trace_caustics: in it the caustics.
    """
    materials = materials_in(scene.description.document, scene.bsdfs())
    needs = buffer_needs(scene, materials)
    layout = needed_layout(needs) if needed_only else BufferLayout()
    if trace_direct and (direct_need(scene).needed or not needed_only):
        layout = layout.adding(["direct"])
    specular = specular_chain(scene, materials, direct="direct" in layout.names)
    chain = specular if trace_specular else None
    caustics = None
    if trace_caustics and specular is not None and "direct" in layout.names:
        caustics = caustics_of(scene, specular)
    return FirstHit(
        layout=layout if chain is None else layout.adding(chain.buffers),
        materials=materials,
        bounds=scene.description.bounds,
        chain=chain,
        caustics=caustics,
    )
