"""Sliders say what the scene does: compared with the values that it is set to."""

from dataclasses import replace

import numpy as np
import pytest

from ngi.scene import SceneDescription, read_scene, scenes
from ngi.scene.kinds import LookAt
from ngi.scene.variable import DiscreteVariable, RangedVariable
from ngi.view.inputs import controls, unnamed_controls
from ngi.view.subject import Camera, camera_of


def shipped(name: str) -> SceneDescription:
    return read_scene(**scenes()[name])


@pytest.mark.parametrize("name", sorted(scenes()))
def test_controls_stand_for_what_the_scene_is_set_to(name: str) -> None:
    scene = shipped(name)
    v = np.random.default_rng(0).random(scene.dimensions)
    made = controls(scene)
    assert [control.component for control in made] == list(range(scene.dimensions))
    values = scene.values(v)
    for (variable, part), value in zip(scene.parts(), values, strict=True):
        own = made[part]
        shown = [control.value(v[control.component]) for control in own]
        if isinstance(variable, DiscreteVariable):
            (control,) = own
            assert control.choice(v[part][0]) == variable.choices[int(value[0])]
            for choice in variable.choices:
                assert control.choice(control.of_choice(choice)) == choice
        elif isinstance(variable, RangedVariable) and not variable.linked:
            varied = np.array(variable.minimum) != np.array(variable.maximum)
            assert shown == pytest.approx(value[varied])
            assert [c.of_value(s) for c, s in zip(own, shown, strict=True)] == pytest.approx(
                v[part]
            )
        else:
            assert shown == pytest.approx(v[part])


def test_values_beyond_a_slider_end_at_its_ends() -> None:
    control = controls(shipped("mirror"))[0]
    assert control.of_value(control.low - 1) == 0
    assert control.of_value(control.high + 1) == 1


def test_components_without_names_are_numbered() -> None:
    assert [(c.group, c.name, c.component) for c in unnamed_controls(2)] == [
        ("v", "1", 0),
        ("v", "2", 1),
    ]


WITH_CAMERA = [
    name for name in sorted(scenes()) if any(isinstance(v, LookAt) for v in shipped(name).variables)
]


def walked(name: str) -> tuple[SceneDescription, Camera]:
    """A scene whose camera walks, and that camera."""
    scene = shipped(name)
    camera = camera_of(scene)
    assert camera is not None
    return scene, camera


@pytest.mark.parametrize("name", WITH_CAMERA)
def test_a_view_that_v_can_have_is_kept(name: str) -> None:
    scene, camera = walked(name)
    generator = np.random.default_rng(1)
    for _ in range(20):
        v = generator.random(scene.dimensions)
        origin, target = camera.view(v)
        moved = v.copy()
        moved[camera.part] = camera.components(origin, target)
        again, target_again = camera.view(moved)
        np.testing.assert_allclose(again, origin, atol=1e-9)
        direction, direction_again = target - origin, target_again - again
        cosine = direction @ direction_again
        cosine /= np.linalg.norm(direction) * np.linalg.norm(direction_again)
        assert cosine > np.cos(np.radians(1e-4))


def test_a_camera_whose_range_falls_is_that_whose_range_rises_the_other_way_round() -> None:
    scene, camera = walked("living-room")
    low, high = camera.variable.minimum, camera.variable.maximum
    falling = replace(camera, variable=replace(camera.variable, minimum=high, maximum=low))
    for v in np.random.default_rng(2).random((20, scene.dimensions)):
        origin, target = camera.view(v)
        expected = 1 - camera.components(origin, target)
        np.testing.assert_allclose(falling.components(origin, target), expected, atol=1e-9)


def test_a_view_beyond_the_box_ends_at_its_wall() -> None:
    _, camera = walked("living-room")
    high = np.array(camera.variable.maximum)
    moved = camera.components(high[:3] + 10, high[3:])
    assert moved[:3].tolist() == [1, 1, 1]
    assert ((moved >= 0) & (moved <= 1)).all()


@pytest.mark.parametrize("name", WITH_CAMERA)
def test_a_mouse_that_turns_little_by_little_turns_the_view_so(name: str) -> None:
    scene, camera = walked(name)
    generator = np.random.default_rng(2)
    for _ in range(8):
        v = generator.random(scene.dimensions)
        origin, target = camera.view(v)
        ahead, up = target - origin, np.array(camera.up)
        across = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
        before = None
        for pitch in np.radians(np.arange(-8, 8, 0.1)):
            turned = ahead * np.cos(pitch) + np.cross(across, ahead) * np.sin(pitch)
            v[camera.part] = camera.components(origin, origin + turned)
            _, end = camera.view(v)
            direction = (end - origin) / np.linalg.norm(end - origin)
            assert before is None or np.linalg.norm(direction - before) < np.radians(0.2)
            before = direction


def test_scenes_whose_camera_stands_have_none() -> None:
    assert camera_of(shipped("cornell-box")) is None
