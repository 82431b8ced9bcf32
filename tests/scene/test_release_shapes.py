"""Shapes, instances and shapegroups of the tagged format: where they stand at some v."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ngi.machine.backend import activate
from ngi.scene.loading import load
from tests.scene.release_files import BALL, GROUP, Loaded, read, tags

INSTANCE = '<shape type="instance" id="var_ball"><ref id="balls"/>{}</shape>'
EMITTER = '<emitter type="area"><rgb name="radiance" value="5, 6, 7"/></emitter>'
MESH = '<string name="filename" value="tetrahedron.ply"/>'
DOWN = (0, -1, 0)


@pytest.fixture(autouse=True)
def _variant():
    activate("scalar")


def place(loaded, *v, shape="var_ball"):
    return loaded.matrix(f"{shape}.to_world", *v)[:3, 3]


def test_instance_stands_between_minimum_and_minimum_plus_range(tmp_path) -> None:
    loaded = Loaded(read(tmp_path, GROUP + INSTANCE.format(tags(3, "-1, 0.5, 2", "2, 1, 0.25"))))
    assert loaded.description.component_names == tuple(f"var_ball.translation.{a}" for a in "xyz")
    assert_allclose(place(loaded, 0, 0, 0), (-1, 0.5, 2), atol=1e-6)
    assert_allclose(place(loaded, 1, 1, 1), (1, 1.5, 2.25), atol=1e-6)
    assert_allclose(place(loaded, 0, 1, 0.5), (-1, 1.5, 2.125), atol=1e-6)


@pytest.mark.parametrize("extent", ["1.2, 0, 0.3", "1.2, -5, 0.3"])
def test_only_axes_with_a_positive_range_take_a_parameter(tmp_path, extent) -> None:
    loaded = Loaded(read(tmp_path, GROUP + INSTANCE.format(tags(2, "-0.6, 7, 0", extent))))
    assert loaded.description.component_names == (
        "var_ball.translation.x",
        "var_ball.translation.z",
    )
    assert_allclose(place(loaded, 0, 0), (-0.6, 7, 0), atol=1e-6)
    assert_allclose(place(loaded, 1, 1), (0.6, 7, 0.3), atol=1e-6)


def test_defaults_are_three_parameters_from_zero_to_one(tmp_path) -> None:
    loaded = Loaded(read(tmp_path, GROUP + INSTANCE.format("")))
    assert loaded.description.dimensions == 3
    assert_allclose(place(loaded, 0, 0, 0), 0, atol=1e-6)
    assert_allclose(place(loaded, 1, 1, 1), 1, atol=1e-6)


def test_offset_counts_from_the_authored_place(tmp_path) -> None:
    authored = '<transform name="to_world"><scale value="2"/><translate y="3"/></transform>'
    body = GROUP + INSTANCE.format(authored + tags(1, "1, 0, 0", "4, 0, 0"))
    matrix = Loaded(read(tmp_path, body)).matrix("var_ball.to_world", 0.5)
    assert_allclose(matrix, [[2, 0, 0, 3], [0, 2, 0, 3], [0, 0, 2, 0], [0, 0, 0, 1]], atol=1e-6)


DOOR = """<shape type="shapegroup" id="panel"><shape type="rectangle">
  <transform name="to_world"><translate x="1" y="1"/></transform></shape></shape>
<shape type="instance" id="var_door"><ref id="panel"/>{}</shape>"""


def test_left_over_parameter_turns_before_the_offset(tmp_path) -> None:
    """A panel from the hinge at the origin to x = 2; turned by 90 degrees about y, to z = -2."""
    turn = tags(1, "10, 0, 5", "0, 0, 0", axis="0, 2, 0", angles=(-90, 180))
    loaded = Loaded(read(tmp_path, DOOR.format(turn)))
    assert loaded.description.component_names == ("var_door.rotation",)
    assert loaded.description.values([0.25]) == [-45]
    for u, tip in [(0, (10, 0, 7)), (0.5, (12, 0, 5)), (1, (10, 0, 3))]:
        matrix = loaded.matrix("var_door.to_world", u)
        assert_allclose(matrix @ (2, 0, 0, 1), (*tip, 1), atol=1e-5)
        assert_allclose(matrix @ (0, 0, 0, 1), (10, 0, 5, 1), atol=1e-5)  # the hinge stays


def test_rotation_comes_after_the_axes_in_v(tmp_path) -> None:
    turn = tags(2, "0, 0, 5", "0, 0, 2", axis="0, 1, 0", angles=(0, 90))
    loaded = Loaded(read(tmp_path, DOOR.format(turn)))
    assert loaded.description.component_names == ("var_door.translation.z", "var_door.rotation")
    assert_allclose(
        loaded.matrix("var_door.to_world", 1, 1) @ (2, 0, 0, 1), (0, 0, 5, 1), atol=1e-5
    )


def test_instance_without_rotation_tags_turns_as_in_the_released_renderer(tmp_path) -> None:
    description = read(tmp_path, DOOR.format(tags(1, "0, 0, 0", "0, 0, 0")))
    (rotation,) = description.variables
    assert (rotation.axis, rotation.minimum, rotation.maximum) == ((1, 1, 1), (0,), (360,))


@pytest.mark.parametrize(
    "shape",
    [
        f'<shape type="ply" id="var_thing">{MESH}{{}}</shape>',
        '<shape type="cube" id="var_thing">{}</shape>',
        '<shape type="sphere" id="var_thing">{}</shape>',
    ],
)
def test_shapes_move_like_instances(tmp_path, shape) -> None:
    """A ray straight down on the point that was above x = z = 0.1 before."""
    still = Loaded(
        read(tmp_path, GROUP + INSTANCE.format("") + shape.format("").replace("var_", ""))
    )
    still.at(0, 0, 0)
    start = np.array([0.1, 40, 0.1])
    authored = still.hit(start, DOWN)
    loaded = Loaded(read(tmp_path, shape.format(tags(2, "1, 2, 3", "4, 0, 5"))))
    for u in [(0, 0), (1, 1)]:
        loaded.at(*u)
        offset = np.array([1, 2, 3]) + np.array([4 * u[0], 0, 5 * u[1]])
        assert_allclose(loaded.hit(start + offset, DOWN), authored + offset, atol=1e-4)


@pytest.mark.parametrize(
    "shape",
    [
        f'<shape type="rectangle" id="var_lamp">{EMITTER}{{}}</shape>',
        f'<shape type="ply" id="var_lamp">{MESH}{EMITTER}{{}}</shape>',
    ],
)
def test_emitting_shapes_move_too(tmp_path, shape) -> None:
    loaded = Loaded(read(tmp_path, BALL + shape.format(tags(1, "0, 0, 2", "30, 0, 0"))))
    towards = (0, 0, -1)
    for u in (0, 0.5, 1):
        loaded.at(u)
        assert_allclose(loaded.emitted((30 * u + 0.2, 0.2, 20), towards), (5, 6, 7), atol=1e-5)
        assert_allclose(loaded.emitted((30 * u - 8.2, 0.2, 20), towards), 0)


LAMPS = f"""<shape type="shapegroup" id="lamp">
  <shape type="rectangle" id="bulb"><transform name="to_world"><translate x="2"/></transform>
    {EMITTER}</shape>{BALL}</shape>"""


def test_group_with_an_emitter_is_taken_apart_and_moves_together(tmp_path) -> None:
    stand = '<transform name="to_world"><translate y="4"/></transform>'
    lamp = f'<shape type="instance" id="var_lamp"><ref id="lamp"/>{stand}{{}}</shape>'
    loaded = Loaded(read(tmp_path, LAMPS + lamp.format(tags(1, "0, 0, 1", "10, 0, 0"))))
    assert loaded.description.dimensions == 1
    for u in (0, 1):
        loaded.at(u)
        assert_allclose(loaded.emitted((10 * u + 2, 4, 20), (0, 0, -1)), (5, 6, 7), atol=1e-5)
        assert_allclose(loaded.hit((10 * u, 4, 20), (0, 0, -1))[2], 1.5, atol=1e-5)  # the ball


def test_group_of_nothing_but_an_emitter_keeps_the_name(tmp_path) -> None:
    group = LAMPS.replace(BALL, "")
    moves = tags(1, "0, 0, 1", "9, 0, 0")
    lamp = f'<shape type="instance" id="var_lamp"><ref id="lamp"/>{moves}</shape>'
    loaded = Loaded(read(tmp_path, BALL + group + lamp))
    assert loaded.description.component_names == ("var_lamp.translation.x",)
    loaded.at(1)
    assert_allclose(loaded.emitted((11, 0, 20), (0, 0, -1)), (5, 6, 7), atol=1e-5)


def test_every_instance_of_a_group_has_its_emitter(tmp_path) -> None:
    ref, up = '<ref id="lamp"/>', '<transform name="to_world"><translate y="9"/></transform>'
    moving = f'<shape type="instance" id="var_lamp">{ref}{tags(1, "0, 0, 0", "9, 0, 0")}</shape>'
    still = f'<shape type="instance">{ref}{up}</shape>'
    loaded = Loaded(read(tmp_path, LAMPS + moving + still))
    loaded.at(1)
    for place_of_bulb in [(11, 0, 20), (2, 9, 20)]:
        assert_allclose(loaded.emitted(place_of_bulb, (0, 0, -1)), (5, 6, 7), atol=1e-5)


def test_turning_group_with_an_emitter(tmp_path) -> None:
    turn = tags(1, "3, 0, 0", "0, 0, 0", axis="0, 0, 1", angles=(0, 90))
    lamp = f'<shape type="instance" id="var_lamp"><ref id="lamp"/>{turn}</shape>'
    loaded = Loaded(read(tmp_path, LAMPS + lamp))
    for u, bulb in [(0, (5, 0, 20)), (1, (3, 2, 20))]:
        loaded.at(u)
        assert_allclose(loaded.emitted(bulb, (0, 0, -1)), (5, 6, 7), atol=1e-5)


def test_shapegroup_shows_one_of_its_shapes_or_none(tmp_path) -> None:
    second = '<shape type="sphere"><point name="center" value="3, 0, 0"/></shape>'
    body = f"""<shape type="shapegroup" id="var_choice">{BALL}{second}{tags(1)}</shape>
      <shape type="instance" id="var_where"><ref id="var_choice"/>{tags(1, "0, 0, 0", "0, 5, 0")}
      </shape>"""
    loaded = Loaded(read(tmp_path, body))
    assert loaded.description.component_names == (
        "+".join(loaded.description.variables[0].objects) + ".translation.y",
        "var_choice.alternatives",
    )
    for u, seen in [(0, (0.5, None)), (0.5, (None, 1)), (1, (None, None))]:
        loaded.at(1, u)
        for x, height in zip((0, 3), seen, strict=True):
            hit = loaded.hit((x, 5, 9), (0, 0, -1))
            assert (hit is None) == (height is None)
            assert hit is None or hit[2] == pytest.approx(height, abs=1e-5)


def test_bounds_hold_every_place_of_everything(tmp_path) -> None:
    body = GROUP + INSTANCE.format(tags(2, "-3, 0, 0", "4, 0, 7"))
    turn = tags(1, "0, 10, 0", "0, 0, 0", axis="0, 0, 1", angles=(0, 90))
    low, high = read(tmp_path, body + DOOR.format(turn)).bounds
    assert_allclose(low, (-3.5, -0.5, -0.5), atol=1e-3)  # the door reaches to x = -2
    assert_allclose(high, (2, 10 + 8**0.5, 7.5), atol=1e-3)  # its corner goes round at that radius


def test_box_of_shapes(tmp_path) -> None:
    """Against Mitsuba's own boxes."""
    turned = """<transform name="to_world"><scale x="2" y="0.5"/><rotate y="1" angle="30"/>
      <rotate value="1, 0, 0" angle="50"/><translate value="1, 2, 3"/></transform>"""
    mesh = '<string name="filename" value="tetrahedron.{}"/>'
    (tmp_path / "tetrahedron.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    shapes = [
        f'<shape type="ply">{mesh.format("ply")}{turned}</shape>',
        f'<shape type="obj">{mesh.format("obj")}{turned}</shape>',
        f'<shape type="rectangle">{turned}</shape>',
        f'<shape type="cube">{turned}</shape>',
        f'<shape type="disk">{turned}</shape>',
        '<shape type="sphere"><point name="center" value="0 2 3"/><float name="radius" value="2"/>'
        f"{turned.replace('scale', 'translate')}</shape>",
        f'<shape type="shapegroup" id="g">{BALL}</shape>'
        f'<shape type="instance"><ref id="g"/>{turned}</shape>',
    ]
    lamp = f'<emitter type="point" id="var_lamp">{tags(1)}</emitter>'
    for shape in shapes:
        description = read(tmp_path, shape + lamp)
        box = load(description.document).bbox()
        assert_allclose(description.bounds[0], np.array(box.min), atol=5e-3, err_msg=shape)
        assert_allclose(description.bounds[1], np.array(box.max), atol=5e-3, err_msg=shape)
