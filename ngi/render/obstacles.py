"""What no renderer takes of a scene, all of it at once."""

from __future__ import annotations

from pathlib import Path

from ngi.machine.backend import mi
from ngi.render.materials import collect_materials
from ngi.render.projection import require_perspective
from ngi.scene.scene_parameters import has_surface


def obstacles(scene: mi.Scene, *, path: Path) -> list[str]:
    """What a renderer of this scene would say is wrong with it. path: of the scene's file"""

    def camera() -> None:
        require_perspective(scene, path=path)

    def materials() -> None:
        collect_materials([shape.bsdf() for shape in scene.shapes() if has_surface(shape)])

    found = []
    for check in (camera, materials):
        try:
            check()
        except ValueError as error:
            found.append(str(error))
    return found
