"""Which tracer a Mitsuba variant and a scene take."""

from __future__ import annotations

import logging

from ngi.render.first_hit import FirstHit
from ngi.render.fitting import FittingTracer
from ngi.render.jit_tracer import JitTracer, free_memory
from ngi.render.scalar_tracer import ScalarTracer
from ngi.render.tracing import Tracer
from ngi.scene import SceneDescription
from ngi.scene.variable_scene import VariableScene

_logger = logging.getLogger(__name__)


def tracer_of(variant: str, scene: VariableScene, first_hit: FirstHit) -> Tracer:
    """What traces a scene with the active variant."""
    if variant == "scalar_rgb":
        return ScalarTracer(scene=scene.scene, first_hit=first_hit)
    recorded = variant != "cuda_ad_rgb" or not _has_slow_textures(scene.description)
    if not recorded:
        _logger.warning(
            "%s: pictures of this scene take longer, because a bitmap has accel=false, which "
            "Dr.Jit 1.5 cannot record on CUDA; remove it unless you need its precision",
            scene.description.document.path,
        )
    tracer = JitTracer(scene=scene, first_hit=first_hit, recorded=recorded)
    return FittingTracer(tracer, free=free_memory)


def _has_slow_textures(description: SceneDescription) -> bool:
    """Whether a bitmap is not to be read by the GPU's texture units.

    Dr.Jit 1.5 ends the process where it records one that is not (docs/upstream.md).
    """
    values = description.document.root.iterfind(".//boolean[@name='accel']")
    return any(value.get("value", "").lower() == "false" for value in values)
