"""The first-intersection buffers (paper, Sec. 4.2): what one camera ray sees before any bounce."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ngi.backend import dr, mi
from ngi.patches import BufferLayout
from ngi.render.emission import emission
from ngi.render.materials import Material, collect_materials, evaluate_materials
from ngi.render.needs import buffer_needs, needed_layout
from ngi.render.specular import SpecularChain, specular_chain
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
    chain: SpecularChain | None

    def channels(self, scene: mi.Scene, ray: mi.Ray3f) -> list[mi.Float]:
        """One value per channel and ray; a ray that misses gives zeros, but the environment's
        emission and the throughput.
        """
        traced: dict[str, list[mi.Float]] = {}
        if self.chain is not None:
            end = self.chain.follow(scene, ray)
            ray = end.ray
            traced = {
                "throughput": list(end.throughput),
                "chain_roughness": [end.roughness],
                "emission": list(end.emission),
            }
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
            if name in traced:
                channels += traced[name]
            elif name == "emission":
                channels += list(emission(scene, hit))
            else:
                channels += [dr.select(valid, c, mi.Float(0)) for c in buffers[name]]
        return channels


def first_hit_of(scene: VariableScene, *, needed_only: bool, trace_specular: bool) -> FirstHit:
    """The buffers that a scene needs, or all; ValueError for a BSDF of an unknown kind.

    trace_specular: those of the first hit that is not specular (paper, Fig. 10).
    """
    materials = collect_materials(scene.bsdfs())
    needs = buffer_needs(scene, materials)
    layout = needed_layout(needs) if needed_only else BufferLayout()
    chain = specular_chain(scene, materials) if trace_specular else None
    return FirstHit(
        layout=layout if chain is None else layout.adding(chain.buffers),
        materials=materials,
        bounds=scene.description.bounds,
        chain=chain,
    )
