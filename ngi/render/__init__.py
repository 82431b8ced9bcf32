"""(scene, v, patch) -> first-intersection buffers and radiance.

`MitsubaRenderer` needs Mitsuba and is imported from `ngi.render.mitsuba_renderer`; everything
here does not.
"""

from ngi.render.analytic import AnalyticRenderer
from ngi.render.pockets import PocketRenderer
from ngi.render.protocol import Deferred, PatchJob, RenderedPatches, Renderer

__all__ = [
    "AnalyticRenderer",
    "Deferred",
    "PatchJob",
    "PocketRenderer",
    "RenderedPatches",
    "Renderer",
]
