"""Where what moves is, against the boxes of Mitsuba's shapes at other v."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import torch

from ngi.files.resources import root
from ngi.machine.backend import activate, llvm_problem, mi
from ngi.patches import MovingPoints
from ngi.scene import read_scene
from ngi.scene.moving_points import MOST, moving_points
from ngi.scene.variable_scene import VariableScene

SCENES = root() / "scenes"
RAISE = {"property": "translation", "minimum": [0, 0, 0], "maximum": [0, 0.9, 0]}
PROJECTOR = """<emitter type="projector" id="beamer"><float name="fov" value="30"/>
<texture type="bitmap" name="irradiance"><string name="filename" value="plain.png"/></texture>
<transform name="to_world"><lookat origin="1, 2, 0.5" target="0, 0, 0" up="0, 1, 0"/></transform>
</emitter>"""


@pytest.fixture(autouse=True)
def llvm() -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    activate("llvm")


def loaded(folder: Path) -> VariableScene:
    return VariableScene(read_scene(folder))


def centre(scene: VariableScene, *names: str) -> torch.Tensor:
    """[3], normalised, of the box around these shapes as they are now."""
    box = mi.ScalarBoundingBox3f()
    for shape in scene.shapes:
        if shape.id() in names:
            box.expand(shape.bbox())
    low, high = np.array(scene.description.bounds)
    return torch.from_numpy((np.array(box.center()).ravel() - low) / (high - low))


def positions(points: MovingPoints, v: np.ndarray) -> torch.Tensor:
    return (points.weight @ torch.from_numpy(v).float() + points.offset).double()


@pytest.mark.parametrize(
    ("name", "things"),
    [
        ("sphere-caustic", [("light",), ("sphere",)]),  # the light first, though it moves less far
        ("veach-egg", [("bulb", "housing"), ("glass_egg",)]),
        ("living-room", [("blind",)]),
        ("spaceship", []),
    ],
)
def test_points_are_where_what_moves_is(name: str, things: list[tuple[str, ...]]) -> None:
    scene = loaded(SCENES / name)
    points = moving_points(scene)
    assert len(points.offset) == len(things)
    for v in np.random.default_rng(0).random((3, scene.description.dimensions)):
        scene.apply(v)
        for position, names in zip(positions(points, v), things, strict=True):
            torch.testing.assert_close(position, centre(scene, *names), atol=1e-5, rtol=0)
    low, high = np.array(scene.description.bounds)
    np.testing.assert_allclose(points.extent, (high - low) / max(high - low), rtol=1e-6)


CHOICE = {"object": "any", "property": "shape", "choices": ["ball", "wedge", "cube"]}
MOVE = {"property": "translation", "minimum": [0, 0, 0], "maximum": [0.4, 0, 0.2]}


def test_what_takes_turns_with_others_is_where_it_is_shown(make_scene) -> None:
    entries = [CHOICE, {"object": "wedge", **MOVE}, {"object": ["ball", "cube"], **RAISE}]
    scene = loaded(make_scene("stage", entries, dimensions=4))
    raised, wedge = positions(moving_points(scene), np.zeros(4))
    boxes = []
    for choice, name in ((0.0, "ball"), (0.5, "wedge"), (1.0, "cube")):
        scene.apply([choice, 0, 0, 0])
        if name == "wedge":
            torch.testing.assert_close(wedge, centre(scene, name), atol=1e-5, rtol=0)
        else:
            boxes.append(next(shape.bbox() for shape in scene.shapes if shape.id() == name))
    boxes[0].expand(boxes[1])
    low, high = np.array(scene.description.bounds)
    expected = (np.array(boxes[0].center()).ravel() - low) / (high - low)
    np.testing.assert_allclose(raised, expected, atol=1e-5)


def test_a_projector_is_where_it_stands(make_scene) -> None:
    def edit(root) -> None:
        root.append(ElementTree.fromstring(PROJECTOR))

    folder = make_scene("stage", [{"object": "beamer", **MOVE}], dimensions=2, edit=edit)
    points = moving_points(loaded(folder))
    for v, place in (([0, 0], [1, 2, 0.5]), ([1, 0.5], [1.4, 2, 0.6])):
        expected = (np.array(place) - [-2, 0, -2]) / [4, 3, 4]
        np.testing.assert_allclose(positions(points, np.array(v))[0], expected, atol=1e-6)


def test_of_many_the_lights_and_what_moves_farthest_are_told() -> None:
    scene = loaded(SCENES / "archviz")
    points = moving_points(scene)
    ranges = {
        variable.objects[0]: np.linalg.norm(np.subtract(variable.maximum, variable.minimum))
        for variable in scene.description.variables
        if variable.kind == "translation"
    }
    lamp = ranges.pop("floor_lamp")
    assert len(ranges) > MOST
    sides = np.subtract(*reversed(scene.description.bounds))
    told = [np.linalg.norm(weight.sum(dim=1).numpy() * sides) for weight in points.weight]
    farthest = sorted(ranges.values(), reverse=True)[: MOST - 1]
    assert lamp < farthest[0]
    np.testing.assert_allclose(told, [lamp, *farthest], rtol=1e-5)
