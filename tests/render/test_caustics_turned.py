"""Photons of several mirrors, and on surfaces that face any way, in bounds of any shape."""

# ruff: noqa: F811 (tests are given the fixture `load` by its name)

import numpy as np
import pytest
import torch

from ngi.machine.backend import mi
from ngi.render.caustics import photon_points
from ngi.render.first_hit import first_hit_of
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.render.optics import dot, rectangle, unit
from tests.render.test_caustics import (
    LAMP,
    LAMP_BEHIND,
    PANE,
    RESOLUTION,
    THIN,
    WALL,
    WALL_AT,
    assert_close,
    direct,
    load,  # noqa: F401, a fixture
    of_a_lamp,
)
from tests.render.test_direct_light import (
    ALBEDO,
    BULB_AT,
    FLOOR,
    INTENSITY,
    MIRROR,
    REFLECTANCE,
)


def test_each_of_two_mirrors_lights_the_floor(load) -> None:
    """One bounce each (max_depth 3): the lamp's two images."""
    other = f'<rotate y="1" angle="90"/><scale value="2"/><translate x="{-WALL_AT}"/>'
    second = rectangle("second", other, MIRROR.replace('id="silver"', 'id="steel"'))
    shapes = FLOOR + LAMP + rectangle("wall", WALL, MIRROR) + second
    added = direct(load(shapes, max_depth=3)) - direct(load(shapes, direct="traced", max_depth=3))
    images = LAMP_BEHIND, BULB_AT * [-1, 1, 1] - [2 * WALL_AT, 0, 0]
    assert_close(added, REFLECTANCE * sum(map(of_a_lamp, images)), mean=0.03, rms=0.2)


TURNS = {  # what turns a floor that faces z, and the same as a matrix
    "z": ("", np.eye(3)),
    "x": ('<rotate y="1" angle="90"/>', np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])),
    "y": ('<rotate x="1" angle="-90"/>', np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])),
    "-y": ('<rotate x="1" angle="90"/>', np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])),
}


@pytest.mark.parametrize("facing", TURNS)
def test_a_floor_may_face_any_way_in_bounds_of_any_shape(load, tmp_path, facing) -> None:
    turn, matrix = TURNS[facing]
    floor = FLOOR.replace('<scale value="4"/>', f'<scale value="4"/>{turn}')
    at = ", ".join(map(str, matrix @ BULB_AT))
    lamp = LAMP.replace(", ".join(map(str, BULB_AT)), at)
    load(floor + lamp + rectangle("wall", WALL + turn, MIRROR))
    yaml = tmp_path / "scene.yaml"
    corners = np.sort([matrix @ [-4.5, -4, -0.5], matrix @ [4.5, 4, 2.5]], axis=0).tolist()
    box = f"bounds: {{minimum: {corners[0]}, maximum: {corners[1]}}},"
    lines = [box if line.startswith("bounds") else line for line in yaml.read_text().splitlines()]
    yaml.write_text("\n".join(lines))
    scene = VariableScene(read_scene(tmp_path))
    options = {"needed_only": True, "trace_specular": False, "trace_direct": True}
    caustics = first_hit_of(scene, trace_caustics=True, **options).caustics
    traced = caustics.trace(scene.scene, photon_points())
    x, y = (c.ravel() for c in np.meshgrid(np.linspace(-1, 1.2, 12), np.linspace(-1.2, 1, 12)))
    places = np.stack([x, y, 0 * x], -1)
    starts, down = (places + np.array([0, 0, 0.2])) @ matrix.T, matrix @ [0, 0, -1]
    hit = scene.scene.ray_intersect(mi.Ray3f(mi.Point3f(*starts.T), mi.Vector3f(*down.tolist())))
    found = caustics.radiance(traced, hit).numpy().T
    away = LAMP_BEHIND - places
    expected = REFLECTANCE * ALBEDO / np.pi * INTENSITY * unit(away)[:, 2:] / dot(away, away)
    assert_close(found, expected, mean=0.03, rms=0.15)


@pytest.mark.parametrize(("max_depth", "lit"), [(3, False), (4, True)])
def test_caustics_behind_a_chain_end_where_the_path_tracers_do(load, max_depth, lit) -> None:
    """Camera, pane, floor, pane, lamp: four segments; the pane keeps all direct light off."""
    shapes = FLOOR + LAMP + rectangle("pane", PANE, THIN)
    renderer = load(shapes, specular="traced", max_depth=max_depth)
    found = direct(renderer)
    if lit:
        assert (found > 0).mean() > 0.9
    else:
        image = renderer.render_image(
            torch.zeros(1), resolution=RESOLUTION, samples_per_pixel=64, seed=0
        )
        dark = image.numpy().max(-1) == 0
        assert dark.mean() > 0.9
        assert (found[dark] == 0).all()
