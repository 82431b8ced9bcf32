"""Emitters and cameras of the tagged format at some v, and what is said of tags."""

import logging
import re

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from ngi.machine.backend import activate, mi
from ngi.render.exr import write_exr
from tests.scene.release_files import BALL, ROOM, SENSOR, WALL, WHITE, Loaded, read, tags

LAMP = """<emitter type="area" id="var_lamp"><rgb name="radiance" value="1, 2, 3"/>{}</emitter>
<shape type="rectangle" id="first"><ref id="var_lamp"/></shape>"""


@pytest.fixture(autouse=True)
def _variant():
    activate("scalar")


def emission(loaded, *v):
    loaded.at(*v)
    return loaded.emitted((0, 0, 9), (0, 0, -1))


def test_order_is_shapes_then_emitters_then_bsdfs_then_sensors(tmp_path) -> None:
    """And within a class as in the file, whatever the ids."""
    moving = f'<shape type="sphere" id="var_{{}}">{tags(1, "0, 0, 0", "1, 0, 0")}</shape>'
    body = WALL.format("diffuse", WHITE) + LAMP.format(tags(1)) + moving.format("z")
    sensor = SENSOR.replace('id="camera"', 'id="var_camera"')
    names = read(tmp_path, body + moving.format("a"), sensor=sensor).component_names
    assert names == (
        "var_z.translation.x",
        "var_a.translation.x",
        "var_lamp.radiance",
        *(f"var_paint.albedo.{channel}" for channel in "rgb"),
        *(f"var_camera.look_at.origin_{axis}" for axis in "xyz"),
        "var_camera.look_at.target_x",
        "var_camera.look_at.target_z",
    )


def test_emitter_with_one_parameter_moves_all_three_together(tmp_path) -> None:
    loaded = Loaded(read(tmp_path, LAMP.format(tags(1, "10, 0, 5", "3000, 500, 0"))))
    assert loaded.description.dimensions == 1
    for u, expected in [(0, (10, 0, 5)), (0.5, (1510, 250, 5)), (1, (3010, 500, 5))]:
        assert_allclose(emission(loaded, u), expected, rtol=1e-6)


def test_emitter_with_three_parameters_has_a_colour(tmp_path) -> None:
    loaded = Loaded(read(tmp_path, LAMP.format(tags(3, "1, 2, 3", "10, 20, 0"))))
    value = emission(loaded, 0.5, 1, 1)
    assert_allclose(value, (6, 22, 3), rtol=1e-6)


def test_emitter_defaults(tmp_path) -> None:
    loaded = Loaded(read(tmp_path, LAMP.format("")))
    assert_allclose(emission(loaded, 0, 0.5, 1), (0, 0.5, 1))


def test_every_shape_with_a_reference_has_the_emitter(tmp_path) -> None:
    second = '<shape type="sphere" id="second"><ref id="var_lamp"/></shape>'
    loaded = Loaded(read(tmp_path, LAMP.format(tags(1, "0, 0, 0", "4, 4, 4")) + second))
    parameters = loaded.at(0.5)
    keys = [key for key in parameters.keys() if key.endswith("radiance.value")]  # noqa: SIM118
    assert len(keys) == 2
    for key in keys:
        assert_allclose(np.array(parameters[key]).reshape(-1), 2)


@pytest.mark.parametrize("authored", ['<rgb name="radiance" value="1, 2, 3"/>', "", "spectrum"])
def test_emission_may_be_authored_in_any_way(tmp_path, authored) -> None:
    authored = authored.replace("spectrum", '<spectrum name="radiance" value="400:1, 700:2"/>')
    emitter = f'<emitter type="area" id="var_lamp">{authored}{tags(3)}</emitter>'
    lamp = f'<shape type="sphere">{emitter}</shape>'
    loaded = Loaded(read(tmp_path, lamp))
    assert_allclose(emission(loaded, 0.25, 0.5, 1), (0.25, 0.5, 1), atol=1e-6)


def test_environment_turns_about_y(tmp_path) -> None:
    """The authored to_world is replaced, as in the released renderer."""
    write_exr(tmp_path / "sky.exr", torch.ones(8, 16, 3))
    sky = """<emitter type="envmap" id="var_sky"><string name="filename" value="sky.exr"/>
      <transform name="to_world"><rotate x="1" angle="77"/></transform></emitter>"""
    loaded = Loaded(read(tmp_path, BALL + sky))
    assert loaded.description.component_names == ("var_sky.rotation",)
    for u in (0, 0.5, 1):
        expected = mi.ScalarTransform4f().rotate([0, 1, 0], 100 + 40 * u).matrix
        assert_allclose(loaded.matrix("var_sky.to_world", u), np.array(expected), atol=1e-6)


def test_camera_looks_into_the_middle_third_at_a_third_of_the_height(tmp_path) -> None:
    """The box counts as authored: -6 to 6, though the ball moves out of it."""
    sensor = SENSOR.replace('id="camera">', f'id="var_camera">{tags(5, "-1, 2, 3", "2, 0, 4")}')
    ball = f'<shape type="sphere" id="var_ball">{tags(1, "0, 0, 0", "50, 0, 0")}</shape>'
    loaded = Loaded(read(tmp_path, ROOM + ball, sensor=sensor))
    assert loaded.description.dimensions == 6
    corners = {
        (0, 0, 0, 0, 0): ((-1, 2, 3), (-2, -2, -2)),
        (1, 1, 1, 1, 1): ((1, 2, 7), (2, -2, 2)),
        (0.5, 0, 0, 0.25, 0): ((0, 2, 3), (-1, -2, -2)),
    }
    for u, (origin, target) in corners.items():
        expected = mi.ScalarTransform4f().look_at(origin, target, [0, 1, 0]).matrix
        matrix = loaded.matrix("var_camera.to_world", 0.5, *u)
        assert_allclose(matrix, np.array(expected), atol=1e-5)


SPHERE = '<shape type="sphere" id="var_ball">{}</shape>'


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (
            SPHERE.format(tags(3, "0, 0, 0", "1.2, -1, 0.3", axis="0, 1, 0")),
            "does not move along that axis, and a component too many turns it",
        ),
        (
            WALL.format(
                "roughconductor", tags(1, "0, 0, 0, 0.01", "0, 0, 0, -0.009", kind="vector4f")
            ),
            "the value falls from min_bounds",
        ),
    ],
)
def test_a_negative_range_is_warned_of(tmp_path, caplog, body: str, says: str) -> None:
    with caplog.at_level(logging.WARNING):
        read(tmp_path, body + ROOM)
    (message,) = [record.getMessage() for record in caplog.records]
    text = (tmp_path / "scene.xml").read_text().splitlines()
    (line,) = [number for number, line in enumerate(text, 1) if "range_bounds" in line]
    place = (
        rf"{tmp_path}/scene\.xml, line {line}: <vector(4f)? name='range_bounds' value='[^']*'> in "
        r"<(shape|bsdf) type='\w+' id='var_\w+'>: a negative number: "
    )
    assert re.match(place, message)
    assert says in message


@pytest.mark.parametrize(
    ("body", "values"),
    [
        (WALL.format("diffuse", tags(3, "0.5, 0, 0", "1, 1, 1")), "albedo 0.5, 0, 0 ... 1.5, 1, 1"),
        (
            WALL.format("roughconductor", tags(1, "0, 0, 0, 0.5", "0, 0, 0, 0.7", kind="vector4f")),
            "roughness 0.5 ... 1.2",
        ),
    ],
)
def test_values_that_a_surface_cannot_have_are_warned_of(tmp_path, caplog, body, values) -> None:
    with caplog.at_level(logging.WARNING):
        read(tmp_path, body + ROOM)
    (message,) = [record.getMessage() for record in caplog.records]
    assert re.match(
        rf"{tmp_path}/scene\.xml, line \d+: <bsdf type='\w+' id='var_paint'>: ", message
    )
    assert values in message


def test_roughness_below_the_smallest_takes_its_component_all_the_same(tmp_path) -> None:
    values = tags(1, "0, 0, 0, 0.0001", "0, 0, 0, 0.0002", kind="vector4f")
    loaded = Loaded(read(tmp_path, WALL.format("roughconductor", values)))
    assert loaded.description.component_names == ("var_paint.roughness",)
    for u in (0, 1):
        (alpha,) = [p for k, p in loaded.at(u).items() if ".alpha" in k]
        assert_allclose(np.array(alpha).reshape(-1), 1e-3, rtol=1e-6)


MISPLACED = tags(1, "0, 0, 0", "1, 1, 1")
STILL = '<shape type="sphere" id="ball">{}</shape>'


@pytest.mark.parametrize(
    ("body", "place"),
    [
        (f'<transform name="to_world">{MISPLACED}</transform>', "a tag in <transform name='to_w"),
        (f'<bsdf type="diffuse"><texture type="bitmap">{MISPLACED}</texture></bsdf>', "in <textu"),
    ],
)
def test_a_tag_in_what_cannot_vary_is_refused(tmp_path, body, place) -> None:
    moving = f'<shape type="sphere" id="var_ball">{tags(1, "0, 0, 0", "1, 0, 0")}{body}</shape>'
    line = (
        r"scene\.xml, line \d+: <integer name='num_parameters' value='1'> in <shape type='sphere'"
    )
    with pytest.raises(ValueError, match=line) as error:
        read(tmp_path, moving)
    assert place in str(error.value)
    with pytest.raises(ValueError, match="a tag in <scene>; it belongs directly into one of <sha"):
        read(tmp_path, SPHERE.format("") + MISPLACED)


def test_tags_of_what_does_not_vary_are_warned_of(tmp_path, caplog) -> None:
    with caplog.at_level(logging.WARNING):
        description = read(tmp_path, STILL.format(MISPLACED) + LAMP.format(tags(1)))
    assert description.component_names == ("var_lamp.radiance",)
    (message,) = [record.getMessage() for record in caplog.records]
    place = re.escape(f"{tmp_path}/scene.xml, line ") + r"\d+: <shape type='sphere' id='ball'>: "
    assert re.match(place + "it does not vary, since its id does not begin with 'var_'", message)
    assert "min_bounds, num_parameters, range_bounds" in message


def test_a_tag_given_twice_is_refused(tmp_path) -> None:
    twice = SPHERE.format(tags(1, "0, 0, 0", "1, 0, 0") + "\n" + tags(2))
    with pytest.raises(ValueError, match=r"line 12: <integer .*, line 9 has this tag already"):
        read(tmp_path, twice)
