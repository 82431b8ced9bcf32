"""What no renderer takes of a scene, all of it at once."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ngi.machine.backend import mi
from ngi.render.materials import materials_in
from ngi.render.projection import require_perspective
from ngi.scene.scene_files import SceneFile
from ngi.scene.scene_parameters import has_surface


def obstacles(scene: mi.Scene, *, document: SceneFile) -> list[str]:
    """What a renderer of this scene, loaded from a document, would say is wrong with it."""

    def camera() -> None:
        require_perspective(scene, document=document)

    surfaces = [shape.bsdf() for shape in scene.shapes() if has_surface(shape)]
    checks: list[Callable[[], object]] = [camera]
    checks += [partial(materials_in, document, [bsdf]) for bsdf in surfaces]
    found = []
    for check in checks:
        try:
            check()
        except ValueError as error:
            found.append(str(error))
    return list(dict.fromkeys(found))  # shapes share materials
