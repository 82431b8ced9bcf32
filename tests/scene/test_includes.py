"""What a scene file includes is read as Mitsuba reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ngi.machine.backend import a_worker_thread, activate, mi
from ngi.scene.loading import load
from ngi.scene.scene_files import named_files, read_scene_file
from tests.scene.stage import write_ply

SCENE = """<scene version="3.0.0"><include filename="parts/more.xml"/>
<include filename="$size.xml"/>
<integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
<shape type="sphere"><float name="radius" value="$radius"/></shape></scene>"""
MORE = """<scene version="3.0.0"><default name="depth" value="5"/>
<default name="size" value="large"/><include filename="deeper.xml"/>
<shape type="ply"><string name="filename" value="mesh.ply"/></shape></scene>"""
DEEPER = """<scene version="3.0.0"><shape type="sphere"><float name="radius" value="{}"/></shape>
</scene>"""
LARGE = """<scene version="3.0.0"><default name="depth" value="9"/>
<default name="radius" value="7"/></scene>"""


def write(folder: Path) -> Path:
    """A scene whose included files have namesakes in its own folder, with other content."""
    parts = folder / "parts"
    parts.mkdir()
    for place, size in ((folder, 1), (parts, 2)):
        write_ply(place / "mesh.ply", size * np.eye(3), [(0, 1, 2)])
        (place / "deeper.xml").write_text(DEEPER.format(size))
    (parts / "more.xml").write_text(MORE)
    (folder / "large.xml").write_text(LARGE)
    (folder / "scene.xml").write_text(SCENE)
    return folder / "scene.xml"


def told(scene: mi.Scene) -> list[str]:
    """Integrator and shapes, as far as files decide them."""
    return [str(scene.integrator()), *(str(shape.bbox()) for shape in scene.shapes())]


def test_names_and_files_are_those_of_mitsuba(tmp_path: Path) -> None:
    """A <default> of an included file counts after it; meshes are in the scene's folder, files
    that an included one includes beside it.
    """
    activate("scalar")
    path = write(tmp_path)
    with a_worker_thread():
        stock = mi.load_file(str(path), optimize=False)
    document = read_scene_file(path)
    assert told(load(document)) == told(stock)
    assert "max_depth = 5" in told(stock)[0]
    names = ["parts/more.xml", "parts/deeper.xml", "large.xml", "mesh.ply"]
    assert [name for name, _ in named_files(document)] == names


def test_what_lies_elsewhere_is_found_too(tmp_path: Path) -> None:
    """A mesh beside the included file, for which Mitsuba does not look there, and outwards."""
    path = write(tmp_path)
    (tmp_path / "parts" / "deeper.xml").unlink()
    (tmp_path / "mesh.ply").unlink()
    names = ["parts/more.xml", "deeper.xml", "large.xml", "parts/mesh.ply"]
    assert [name for name, _ in named_files(read_scene_file(path))] == names
