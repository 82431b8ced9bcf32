"""The scenes of the paper's authors, where they are: $NGI_RELEASE_SCENES, or shared/scenes."""

import os
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from ngi.machine.backend import activate, mi
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene.release import read_release
from tests.scene.release_files import Loaded

SCENES = Path(
    os.environ.get("NGI_RELEASE_SCENES", Path(__file__).parents[2].parent / "shared" / "scenes")
)
SETTINGS = {
    "sphere-caustic": (12, 400, 5),
    "living-room": (7, 400, 9),
    "veach-ajar": (6, 600, 9),
    "bedroom": (6, 400, 5),
    "bathroom": (8, 800, 5),
    "spaceship": (8, 1200, 9),
    "veach-egg": (9, 24000, 12),
}
"""Dimensions, samples per pixel and longest path in vertices."""


def release(name):
    folder = SCENES / name
    if not (folder / "scene.xml").is_file():
        pytest.skip(f"no {folder}; name the folder of the authors' scenes in NGI_RELEASE_SCENES")
    return read_release(folder)


@pytest.mark.parametrize("name", SETTINGS)
def test_scene_renders_wherever_its_variables_are(name) -> None:
    """At 0, 1/2 and 1 of every component and at random v."""
    description = release(name)
    size = description.dimensions
    assert SETTINGS[name] == (size, description.samples_per_pixel, description.max_depth)
    assert description.name == name
    renderer = MitsubaRenderer(
        scene=description, backend="scalar", patch_size=8, samples_per_pixel=1
    )
    generator = np.random.default_rng(0)
    corners = np.concatenate([0.5 + (u - 0.5) * np.eye(size) for u in (0, 0.5, 1)])
    states = np.concatenate([corners, generator.random((20, size))])
    positions = generator.random((len(states), 2))
    states = torch.tensor(np.concatenate([states, positions], axis=1), dtype=torch.float32)
    patches = renderer.render_patches(states, resolution=16, seed=0)
    assert patches.masked == 0
    assert bool(torch.isfinite(patches.log_radiance).all())
    assert bool(torch.isfinite(patches.buffers).all())
    assert float((patches.log_radiance.sum(dim=(1, 2, 3)) > 0).float().mean()) > 0.5


@pytest.fixture
def load():
    def load(name):
        activate("scalar")
        return Loaded(release(name))

    return load


def at(loaded, **components):
    """V of one half but for components, by their names with '_' for '.' and '+'."""
    names = loaded.description.component_names
    v = dict.fromkeys((name.replace(".", "_").replace("+", "_") for name in names), 0.5)
    assert set(components) <= set(v)
    return tuple((v | components).values())


def test_sphere_and_light_of_sphere_caustic(load) -> None:
    scene = load("sphere-caustic")
    corner = {f"var_sphere_translation_{axis}": 0 for axis in "xyz"}
    for u, expected in [(0, (-0.6, 0.3, 0)), (1, (0.6, 1.3, 0.3))]:
        v = at(scene, **dict.fromkeys(corner, u))
        assert_allclose(scene.matrix("var_sphere.to_world", *v)[:3, 3], expected, atol=1e-6)
    for u, x in [(0, -0.605), (1, 0.595)]:  # the light is authored at x = -0.005
        scene.at(*at(scene, var_light_translation_x=u, var_light_translation_z=0))
        assert_allclose(scene.emitted((x, 1.5, -0.03), (0, 1, 0)), (54, 38, 12), rtol=1e-5)
        assert_allclose(scene.emitted((-x, 1.5, -0.03), (0, 1, 0)), 0)


def test_blinds_and_lamp_of_the_living_room(load) -> None:
    scene = load("living-room")
    for u, height in [(0, 0.3), (0.5, 1.1), (1, 1.9)]:
        v = at(scene, var_blinds_translation_y=u, var_lamp_emitter_radiance=u)
        assert_allclose(scene.matrix("var_blinds.to_world", *v)[:3, 3], (0, height, 0), atol=1e-6)
        parameters = scene.at(*v)
        (radiance,) = [k for k in parameters.keys() if k.endswith("radiance.value")]  # noqa: SIM118
        assert_allclose(np.array(parameters[radiance]).reshape(-1), 500 * u)


def test_door_of_veach_ajar(load) -> None:
    scene = load("veach-ajar")
    for u, angle in [(0, -15), (0.5, 25), (1, 65)]:
        turned = mi.ScalarTransform4f().translate([-2.8, 0, -4.67]).rotate([0, -1, 0], angle)
        matrix = scene.matrix("var_door.to_world", *at(scene, var_door_rotation=u))
        assert_allclose(matrix, np.array(turned.matrix), atol=1e-5)


def test_sky_of_the_bedroom(load) -> None:
    scene = load("bedroom")
    for u, angle in [(0, 100), (1, 140)]:
        turned = mi.ScalarTransform4f().rotate([0, 1, 0], angle)
        matrix = scene.matrix("var_envmap.to_world", *at(scene, var_envmap_rotation=u))
        assert_allclose(matrix, np.array(turned.matrix), atol=1e-5)


def test_lamp_of_the_bathroom(load) -> None:
    scene = load("bathroom")
    key = "var_emitter.vertex_positions"
    authored = np.array(mi.traverse(scene.scene)[key]).reshape(-1, 3)
    v = at(scene, var_emitter_translation_x=1, var_emitter_translation_z=0)
    moved = np.array(scene.at(*v)[key]).reshape(-1, 3)
    assert_allclose(moved - authored, np.broadcast_to((7, 0, -10), moved.shape), atol=1e-5)


def test_lamp_of_the_veach_egg_moves_with_its_light(load) -> None:
    scene = load("veach-egg")
    shift = at(scene, **{f"var_emitter_var_emitter_emitter_translation_{axis}": 1 for axis in "xy"})
    for v, offset in [(at(scene), (0, 0, 0)), (shift, (0.8, 1, 0))]:
        lamp = scene.matrix("var_emitter.to_world", *v)[:3, 3]
        light = scene.matrix("var_emitter_emitter.to_world", *v)[:3, 3]
        assert_allclose(lamp, offset, atol=1e-6)
        assert_allclose(light - offset, (-2.69082, 5.10417, -3.77057), atol=1e-5)


def test_camera_of_the_veach_egg(load) -> None:
    scene = load("veach-egg")
    low, high = (np.array(corner) for corner in scene.description.bounds)
    assert_allclose((low, high), [(-4, -0.0965, -4), (4, 8, 4)], atol=1e-3)  # nothing leaves it
    view = {f"var_sensor_look_at_origin_{axis}": 1 for axis in "xyz"}
    v = at(scene, **view, var_sensor_look_at_target_x=0, var_sensor_look_at_target_z=1)
    target = [-4 / 3, low[1] + (high[1] - low[1]) / 3, 4 / 3]
    expected = mi.ScalarTransform4f().look_at([4.5, 3.3, 3.7], target, [0, 1, 0])
    assert_allclose(scene.matrix("var_sensor.to_world", *v), np.array(expected.matrix), atol=1e-4)
