"""What becomes of the rest of a tagged file, and what is said about one that is wrong."""

import logging

import numpy as np
import pytest

from ngi.scene.release import read_release
from tests.scene.release_files import BALL, GROUP, PATH, ROOM, SENSOR, read, tags, write

LAMP = f'<emitter type="point" id="var_lamp">{tags(1)}</emitter>'
FIRST_LINE = 9
"""Of the body in a file of `write`."""

AOV = """<integrator type="aov"><string name="aovs" value="1emission:emission"/>
  <integrator type="path" name="image"><integer name="max_depth" value="7"/>{}</integrator>
  <integer name="samples_per_pass" value="20"/></integrator>"""


def test_path_tracer_is_taken_out_of_the_buffers(tmp_path) -> None:
    description = read(tmp_path, BALL + LAMP, integrator=AOV.format(""))
    (integrator,) = description.document.root.findall("integrator")
    assert (integrator.get("type"), description.max_depth) == ("path", 7)
    assert not list(description.document.root.iter("string"))


def test_no_depth_is_no_limit(tmp_path) -> None:
    assert read(tmp_path, BALL + LAMP, integrator='<integrator type="path"/>').max_depth == -1


@pytest.mark.parametrize("value", ["true", "True"])
def test_emitters_are_shown(tmp_path, caplog, value: str) -> None:
    hidden = f'<boolean name="hide_emitters" value="{value}"/>'
    description = read(tmp_path, BALL + LAMP, integrator=AOV.format(hidden))
    assert description.document.root.find(".//boolean").get("value") == "false"
    assert "hide_emitters" in caplog.text


def test_film_becomes_square_with_the_field_of_view_of_its_width(tmp_path, caplog) -> None:
    wide = SENSOR.replace('name="width" value="16"', 'name="width" value="32"')
    film = read(tmp_path, BALL + LAMP, sensor=wide).document.root.find("sensor/film")
    assert [size.get("value") for size in film.findall("integer")] == ["32", "32"]
    assert "32 x 16" in caplog.text


@pytest.mark.parametrize(
    ("axis", "width", "kept"),
    [
        ("x", 32, "width"),
        ("y", 32, "height"),
        ("smaller", 32, "height"),
        ("larger", 32, "width"),
        ("smaller", 8, "width"),
        ("larger", 8, "height"),
    ],
)
def test_which_field_of_view_is_kept_is_said(tmp_path, caplog, axis, width, kept) -> None:
    sensor = SENSOR.replace('name="width" value="16"', f'name="width" value="{width}"')
    sensor = sensor.replace("<film", f'<string name="fov_axis" value="{axis}"/><film')
    read(tmp_path, BALL + LAMP, sensor=sensor)
    assert f"with the field of view of its {kept}" in caplog.text


def test_samples_per_pixel_are_the_samplers(tmp_path) -> None:
    assert read(tmp_path, BALL + LAMP).samples_per_pixel == 8
    bare = '<sensor type="perspective"/>'
    assert read(tmp_path, BALL + LAMP, sensor=bare).samples_per_pixel == 4


def test_defaults_of_the_file_count(tmp_path) -> None:
    sensor = '<default name="spp" value="33"/>' + SENSOR.replace('value="8"', 'value="$spp"')
    assert read(tmp_path, BALL + LAMP, sensor=sensor).samples_per_pixel == 33


def test_tags_without_the_id_mean_nothing(tmp_path, caplog) -> None:
    still = f'<shape type="sphere" id="walls">{tags(1, "5, 5, 5", "1, 2, 3")}</shape>'
    with caplog.at_level(logging.INFO):
        description = read(tmp_path, still + LAMP)
    assert description.dimensions == 1
    assert np.allclose(description.bounds, [[-1] * 3, [1] * 3], atol=1e-6)
    assert "walls" in caplog.text


def test_scene_without_a_height_has_a_box_all_the_same(tmp_path) -> None:
    low, high = read(tmp_path, '<shape type="rectangle"/>' + LAMP).bounds
    assert all(high[axis] > low[axis] for axis in range(3))


def test_name_frames_and_hash(tmp_path) -> None:
    folder = tmp_path / "my-room"
    folder.mkdir()
    mesh = '<shape type="ply"><string name="filename" value="tetrahedron.ply"/></shape>'
    description = read(folder, mesh + LAMP)
    assert description == description
    assert description.name == "my-room"
    assert len(description.hard_frames) == 10
    assert description.camera_path == description.hard_frames[:6]
    assert np.unique(np.array(description.hard_frames), axis=0).shape == (10, 1)
    again = read_release(folder / "scene.xml")
    assert (again.scene_hash, again.hard_frames) == (
        description.scene_hash,
        description.hard_frames,
    )
    with (folder / "tetrahedron.ply").open("a") as file:
        file.write("\n")
    assert read_release(folder).scene_hash != description.scene_hash


CHEQUERED = """<bsdf type="diffuse" id="var_m">
<texture type="checkerboard" name="reflectance"/>{}</bsdf>"""
VARIED_GROUP = f'<shape type="shapegroup" id="var_g">{BALL}{{}}</shape>'
INSTANCE = '<shape type="instance"><ref id="g"/></shape>'
VARIED = '<shape type="sphere" id="var_b">\n{}</shape>'


@pytest.mark.parametrize(
    ("body", "line", "words"),
    [
        (VARIED.format(tags(2, "0, 0, 0", "1, 1, 1")), 1, ["num_parameters is 2", "3 axes"]),
        (VARIED.format(tags(3, "0, 0, 0", "1, 1, 0")), 1, ["num_parameters is 3", "2 axes"]),
        (VARIED.format(tags(0, "0, 0, 0", "0, 0, 0")), 1, ["0 axes"]),
        (VARIED.format('<vector name="max_bounds" value="1, 1, 1"/>'), 2, ["min_bounds"]),
        (VARIED.format('<integer name="num_params" value="3"/>'), 2, ["mean 'num_parameters'"]),
        (VARIED.format('<vector name="min_bounds" value="1, x"/>'), 2, ["1, x", "numbers"]),
        (VARIED.format('<vector name="min_bounds" value="1, 2"/>'), 2, ["2 numbers instead of 3"]),
        (VARIED.format('<integer name="num_parameters" value="1.5"/>'), 2, ["integer"]),
        (VARIED.format('<vector name="rotation_axis" value="0"/>'), 2, ["direction"]),
        (f'\n<emitter type="point" id="var_e">{tags(2)}</emitter>', 2, ["3 is radiance", "1 "]),
        (f'\n<emitter type="envmap" id="var_e">{tags(3)}</emitter>', 2, ["turns"]),
        ('\n<emitter type="sunsky" id="var_e"/>', 2, ["sunsky", "point", "envmap"]),
        ('\n<emitter type="area" id="var_e"/>', 2, ["to this area emitter; give one"]),
        (f'\n<bsdf type="diffuse" id="var_m">{tags(2)}</bsdf>', 2, ["colour", "roughness"]),
        ('\n<bsdf type="null" id="var_m"/>', 2, ["null", "roughconductor"]),
        ('\n<texture type="bitmap" id="var_t"/>', 2, ["<texture", "<shape>"]),
        (f'<shape type="shapegroup" id="g">\n{VARIED.format("")}</shape>', 2, ["instance"]),
        (f"\n{CHEQUERED.format(tags(3))}", 2, ["factor on bitmaps, not on a 'checkerboard'"]),
        (f"\n{CHEQUERED.format(tags(1))}", 2, ["no shape has a <ref> to it; give one"]),
        (
            '\n<shape type="instance" id="var_b"><ref id="nowhere"/></shape>',
            2,
            ["one <ref> to a", "nowhere"],
        ),
        (f'{GROUP}\n<shape type="instance"/>', 2, ["one <ref> to a shapegroup"]),
        (f'<shape type="shapegroup" id="g">\n{INSTANCE}</shape>{INSTANCE}', 2, ["cannot be part"]),
        (f"\n{VARIED_GROUP.format(tags(2))}", 2, ["num_parameters is 2; a group has 1"]),
        (f"\n{VARIED_GROUP.format(tags(1))}", 2, ["0 instances; a group that varies has one"]),
        ('\n<shape type="ply"/>', 2, ["names no file", "filename"]),
        ('\n<shape type="bagel"/>', 2, ["bagel", "sphere"]),
        ('\n<bsdf type="diffuse"><vector4f name="k" value="1, 1, 1, 1"/></bsdf>', 2, ["tags"]),
        (ROOM.replace("<scale", "\n<squash"), 2, ["squash", "translate"]),
        ('<bsdf type="diffuse" id="m"/>\n<bsdf type="diffuse" id="m"/>', 2, ["line 9"]),
        ('\n<include filename="other.xml"/>', 2, ["include"]),
    ],
)
def test_errors_name_file_line_and_what_is_known(tmp_path, body, line, words) -> None:
    path = write(tmp_path, body + BALL + LAMP)
    with pytest.raises(ValueError, match=str(path)) as error:
        read_release(tmp_path)
    message = str(error.value)
    assert f"line {FIRST_LINE + line - 1}:" in message, message
    assert all(word in message for word in words), message


def test_broken_xml_and_a_scene_without_variables(tmp_path) -> None:
    write(tmp_path, "\n<shape>")
    with pytest.raises(ValueError, match=r"scene\.xml: not well-formed XML: .*line 11"):
        read_release(tmp_path)
    write(tmp_path, BALL)
    with pytest.raises(ValueError, match=r"line 2: <scene>: nothing varies: no id .* 'var_'"):
        read_release(tmp_path)


@pytest.mark.parametrize(
    ("sensor", "integrator", "line", "word"),
    [
        (SENSOR.replace('id="camera">', f'id="var_camera">{tags(4)}'), PATH, 4, "5"),
        (SENSOR.replace('value="8"', 'value="0"'), PATH, 6, "positive"),
        ("", PATH, 2, "<sensor>"),
        (SENSOR, "", 2, "<integrator>"),
        (SENSOR, '<integrator type="aov"/>', 3, "buffers"),
    ],
)
def test_errors_of_camera_and_integrator(tmp_path, sensor, integrator, line, word) -> None:
    write(tmp_path, BALL + LAMP, sensor=sensor, integrator=integrator)
    with pytest.raises(ValueError, match=word) as error:
        read_release(tmp_path)
    assert f"scene.xml, line {line}" in str(error.value)


def test_missing_files_are_named(tmp_path) -> None:
    mesh = '<shape type="ply"><string name="filename" value="{}"/></shape>'
    write(tmp_path, f"{mesh.format('gone.ply')}\n{mesh.format('lost.ply')}{LAMP}")
    with pytest.raises(FileNotFoundError) as error:
        read_release(tmp_path)
    assert all(
        part in str(error.value)
        for part in ("line 9: <shape> names 'gone.ply'", "line 10: <shape> names 'lost.ply'")
    )
    with pytest.raises(FileNotFoundError, match="nowhere"):
        read_release(tmp_path / "nowhere")
