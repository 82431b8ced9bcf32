"""What a program that embeds a network has to know: its inputs, their units, where it is from."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from ngi.patches import BufferLayout
from ngi.provenance import provenance
from ngi.scene import SceneDescription
from ngi.view.trained_run import TrainedRun

BUFFERS = {
    "position": "world position p of the hit: (p - minimum) / (maximum - minimum) of 'bounds'",
    "normal": "shading normal n in world space: n / 2 + 1 / 2",
    "outgoing": "unit vector from the surface towards the camera, world space, in [-1, 1]",
    "albedo": "diffuse or specular reflectance, linear RGB in [0, 1]",
    "roughness": "alpha of GGX or Beckmann; 0 where perfectly smooth, 1 where diffuse",
    "throughput": "of the specular bounces before the surface, linear RGB; 1 where there is none",
    "chain_roughness": "sqrt of the sum of alpha^2 over these bounces",
    "direct": "log(1 + x) of the pixel's mean direct light x, linear RGB: the radiance that leaves "
    "the surface towards the camera after one bounce from an emitter, times the throughput",
    "emission": "log(1 + x) of the mean emitted radiance x of the pixel, linear RGB",
}
"""What the channels of `BufferLayout` are."""

PIXELS = (
    "each channel is the mean over the pixel's camera rays; a ray that hits nothing counts as 0, "
    "but for its throughput and the environment's emission"
)
RADIANCE = "linear RGB in the scene's units, as the network gives it: it may be slightly negative"
COMPONENTS = (
    "each variable's components of v follow those of the one before. u in [0, 1] stands for "
    "minimum + u * (maximum - minimum); a number whose minimum equals its maximum takes no "
    "component; with 'linked' one u moves all numbers. Of n choices u stands for number "
    "min(floor(n * u), n - 1). Keys and frames are spread evenly from 0 to 1."
)


def network_metadata(run: TrainedRun) -> dict[str, str]:
    """By key, structures as JSON. Closed formulas have no bounds and no variables."""
    origin = provenance(backend=run.renderer.description)
    return {
        "scene": run.scene_name,
        "scene_hash": run.renderer.scene_hash,
        "step": str(run.step),
        "commit": f"{origin['commit'] or 'unknown'}{' (changed since)' if origin['dirty'] else ''}",
        "versions": json.dumps(origin["versions"]),
        "precision": f"float32; trained as {run.precision}",
        "buffers": json.dumps(list(_buffers(run.renderer.layout))),
        "pixels": PIXELS,
        **({} if run.description is None else scene_metadata(run.description)),
        "radiance": RADIANCE,
    }


def scene_metadata(description: SceneDescription) -> dict[str, str]:
    """The box that positions count in, and the variables as scene.yaml has them, in order of v."""
    low, high = description.bounds
    names = description.component_names
    variables = [
        {"components": names[part], "kind": variable.kind, **asdict(variable)}
        for variable, part in description.parts()
    ]
    return {
        "bounds": json.dumps({"minimum": low, "maximum": high}),
        "variables": json.dumps(variables),
        "v": COMPONENTS,
    }


def _buffers(layout: BufferLayout) -> Iterable[dict[str, Any]]:
    """In order of the channels."""
    for name in layout.names:
        part = layout.slice(name)
        channels = part.stop - part.start
        yield {"name": name, "first": part.start, "channels": channels, "meaning": BUFFERS[name]}
