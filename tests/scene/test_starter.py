"""The scene.yaml that a plain Mitsuba scene starts with."""

from pathlib import Path

import numpy as np
import pytest

from ngi.machine.backend import activate, mi
from ngi.scene import read_scene
from ngi.scene.scene_files import read_scene_file
from ngi.scene.starter import candidates
from ngi.scene.variable_scene import VariableScene
from ngi.view.describe import main

PLAIN = """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"{}/>
<shape type="sphere"/></scene>"""


def test_a_scene_whose_objects_have_no_ids_has_nothing_to_start_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = tmp_path / "scene.xml"
    document.write_text(PLAIN.format(""))
    assert main([str(document), "backend=scalar"]) == 2
    said = f"{document}: no object with an id can vary; give ids to its objects\n"
    assert capsys.readouterr().err == said
    assert not (tmp_path / "scene.yaml").exists()
    document.write_text(PLAIN.format(' id="camera"'))
    assert main([str(document), "backend=scalar"]) == 0
    assert "- {object: camera, property: look_at" in (tmp_path / "scene.yaml").read_text()


RGB = '<rgb name="{}" value="0.5, 0.4, 0.3"/>'
WOOD = '<texture type="bitmap" name="{}"><string name="filename" value="wood.png"/></texture>'
DIFFUSE, COAT = "diffuse_reflectance", "specular_reflectance"


@pytest.mark.parametrize(
    ("reflectances", "offered"),
    [
        (WOOD.format(DIFFUSE) + RGB.format(COAT), ["texture"]),
        (RGB.format(DIFFUSE) + WOOD.format(COAT), ["albedo"]),
        (RGB.format(COAT), []),
    ],
)
def test_the_coat_of_a_plastic_is_not_its_albedo(tmp_path: Path, reflectances, offered) -> None:
    activate("scalar")
    mi.Bitmap(np.full((4, 4, 3), 128, np.uint8)).write(str(tmp_path / "wood.png"))
    document = tmp_path / "scene.xml"
    document.write_text(
        f"""<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere">
        <bsdf type="twosided" id="table"><bsdf type="plastic">{reflectances}</bsdf></bsdf>
        </shape></scene>"""
    )
    loaded = mi.load_file(str(document), optimize=False)
    found, _ = candidates(read_scene_file(document), loaded)
    assert [c.property for c in found if c.object == "table"] == offered


DOOR = "v 3 0 0\nv 4 0 0\nv 4 2 0\nv 3 2 0\nf 1 2 3\nf 1 3 4\n"
ROOM = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective" id="camera">{sampler}
<transform name="to_world"><lookat origin="{origin}" target="0, 0, 0" up="{up}"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>{more}
<shape type="obj" id="door"><string name="filename" value="door.obj"/></shape>
<shape type="cube" id="box"><transform name="to_world"><scale value="5"/></transform></shape>
<emitter type="directional" id="sun"><vector name="direction" value="0, -1, -1"/></emitter>
</scene>"""
SECOND = """<sensor type="perspective" id="behind"><transform name="to_world">
<lookat origin="-1, 2, -4" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>"""


def room(folder: Path, **parts: str) -> Path:
    """The file of a scene that shows a door whose mesh lies where it stands."""
    (folder / "door.obj").write_text(DOOR)
    document = folder / "scene.xml"
    plain = {"sampler": "", "origin": "1, 2, -4", "up": "0, 1, 0", "more": ""}
    document.write_text(ROOM.format(**plain | parts))
    return document


def started(document: Path) -> str:
    assert main([str(document), "backend=scalar"]) == 0
    return (document.parent / "scene.yaml").read_text()


@pytest.mark.parametrize(
    ("origin", "up", "axis", "offsets"),
    [
        ("1, 2, -4", "0, 1, 0", "[0, 1, 0]", "0, "),
        ("-4, -4, 5", "0, 0, 1", "[0, 0, 1]", ", 0]"),  # its own up is 0.4 along y
        ("0, 1, -4", "0, 0, 1", "[0, 1, 0]", "0, "),  # upright with both
    ],
)
def test_the_camera_tells_which_axis_is_up(tmp_path: Path, origin, up, axis, offsets) -> None:
    document = room(tmp_path, origin=origin, up=up)
    text = started(document)
    (turned,) = [line for line in text.splitlines() if "object: door, property: rotation" in line]
    (moved,) = [line for line in text.splitlines() if "object: door, property: transl" in line]
    assert f"axis: {axis}" in turned
    assert offsets in moved.split("minimum: [")[1].split("maximum")[0]
    authored = mi.traverse(mi.load_file(str(document)))["camera.to_world"].matrix
    scene = VariableScene(read_scene(tmp_path))
    scene.apply([0.5] * scene.description.dimensions)
    proposed = mi.traverse(scene.scene)["camera.to_world"].matrix
    np.testing.assert_allclose(np.array(proposed), np.array(authored), atol=2e-3)


def test_a_mesh_without_a_place_turns_about_its_middle(tmp_path: Path) -> None:
    text = started(room(tmp_path))
    assert "{object: door, property: rotation, axis: [0, 1, 0], pivot: [3.5, 1, 0], min" in text
    assert "{object: door, property: scale, pivot: [3.5, 1, 0], minimum" in text
    assert "{object: box, property: scale, minimum" in text


@pytest.mark.parametrize(
    ("sampler", "count"),
    [
        ("", 64),
        ('<sampler type="independent"/>', 64),
        ('<sampler type="independent"><integer name="sample_count" value="256"/></sampler>', 256),
    ],
)
def test_samples_are_those_that_the_file_says(tmp_path: Path, sampler: str, count: int) -> None:
    assert f"\nsamples_per_pixel: {count} " in started(room(tmp_path, sampler=sampler))


def test_a_sun_moves_about_where_it_stands(tmp_path: Path) -> None:
    text = started(room(tmp_path))
    assert "{object: sun, property: direction, minimum: [-15, 30], maximum: [15, 60]}" in text


def test_of_several_cameras_there_is_a_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "camera_path, " not in started(room(tmp_path))
    (tmp_path / "scene.yaml").unlink()
    text = started(room(tmp_path, more=SECOND))
    (path,) = [line for line in text.splitlines() if "property: camera_path" in line]
    assert "object: camera" in path
    assert "keys: [[1, 2, -4, " in path
    assert "], [-1, 2, -4, " in path
    assert "  not rendered: behind; of several" in capsys.readouterr().out


def test_what_a_shape_receives_is_no_view(tmp_path: Path) -> None:
    meter = '<shape type="rectangle"><sensor type="irradiancemeter" id="meter"/></shape>'
    assert "camera_path, " not in started(room(tmp_path, more=meter))


def test_every_material_that_cannot_be_trained_on_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape = '<shape type="sphere"><bsdf type="{}" id="{}">{}</bsdf></shape>'
    inner = '<bsdf type="diffuse"/>'
    blend = 2 * inner + '<float name="weight" value="0.5"/>'
    more = shape.format("mask", "leaf", inner) + shape.format("blendbsdf", "rust", blend)
    started(room(tmp_path, more=more))
    said = capsys.readouterr().out
    assert said.count("cannot be trained on as it is") == 2
