"""The radiance that a hit emits."""

from __future__ import annotations

from ngi.machine.backend import mi


def emission(scene: mi.Scene, hit: mi.SurfaceInteraction3f) -> mi.Color3f:
    """Linear radiance emitted back along the ray, the environment's where the ray misses."""
    emitter = hit.emitter(scene)
    if emitter is None:  # in a scalar variant
        return mi.Color3f(0)
    return mi.Color3f(emitter.eval(hit))
