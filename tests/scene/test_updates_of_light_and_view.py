"""Lights, sky and camera that vary, against scenes written with their values."""

from xml.etree import ElementTree

import numpy as np
import pytest

from tests.scene.stage import find, moved, rotate, set_value
from tests.scene.updates import Update, check_update

INTENSITY = {"property": "intensity", "minimum": 0.5, "maximum": 2.5}
RADIANCE = {"property": "radiance", "minimum": [0, 2, 4], "maximum": [4, 2, 12]}


def with_colour(object_id, name, value):
    return lambda root: set_value(root, object_id, name, value)


LIGHTS = [
    *(
        Update(
            f"intensity of '{object_id}'",
            variables=[{"object": object_id, **INTENSITY}],
            v=[0.75],
            off=[0.6],
            edit=with_colour("lamp", "radiance", "20, 16, 12"),
        )
        for object_id in ("lamp", "light")
    ),
    Update(
        "radiance",
        variables=[{"object": ["glow", "lamp"], **RADIANCE}],
        v=[0.25, 0.5],
        off=[0.25, 0.4],
        edit=lambda root: [
            set_value(root, name, "radiance", "1, 2, 8") for name in ("glow", "lamp")
        ],
    ),
    Update(
        "intensity and radiance of one emitter, by its own id and its shape's",
        variables=[{"object": "lamp", **INTENSITY}, {"object": "light", **RADIANCE}],
        v=[0.75, 0.25, 0.5],
        off=[0.6, 0.25, 0.5],
        edit=with_colour("lamp", "radiance", "2, 4, 16"),
    ),
    Update(
        "intensity of sun and sky",
        scene="field",
        variables=[{"object": "sun", **INTENSITY}, {"object": "sky", **INTENSITY}],
        v=[0.25, 0.75],
        off=[0.25, 0.6],
        edit=lambda root: (
            set_value(root, "sun", "irradiance", "2, 2, 1.5"),
            ElementTree.SubElement(find(root, "sky"), "float", name="scale", value="2"),
        ),
    ),
    Update(
        "radiance of the sun",
        scene="field",
        variables=[{"object": "sun", **RADIANCE}],
        v=[0.25, 0.5],
        off=[0.5, 0.5],
        edit=with_colour("sun", "irradiance", "1, 2, 8"),
    ),
]


def sun_from(azimuth, elevation):
    """The sun's direction as Mitsuba has it: along the light."""
    azimuth, elevation = np.radians([azimuth, elevation])
    x, z = np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth)

    def edit(root) -> None:
        sun = find(root, "sun")
        sun.remove(sun.find("transform"))
        direction = {"x": -x, "y": -np.sin(elevation), "z": -z}
        attributes = {name: repr(float(c)) for name, c in direction.items()}
        ElementTree.SubElement(sun, "vector", name="direction", **attributes)

    return edit


SUN_AND_SKY = [
    *(
        Update(
            f"direction of the sun {v}",
            scene="field",
            variables=[
                {
                    "object": "sun",
                    "property": "direction",
                    "minimum": [0, 30],
                    "maximum": [360, 90],
                }
            ],
            v=v,
            off=off,
            edit=sun_from(360 * v[0], 30 + 60 * v[1]),
        )
        for v, off in (([0.25, 0.5], [0.4, 0.5]), ([0, 1], [0, 0.8]))
    ),
    Update(
        "visibility under sun and sky",
        scene="field",
        variables=[{"object": ["ball", "post"], "property": "visibility"}],
        v=[0.2],
        off=[0.8],
        edit=lambda root: [root.remove(find(root, name)) for name in ("ball", "post")],
    ),
    Update(
        "rotation of the sun",
        scene="field",
        variables=[
            {
                "object": "sun",
                "property": "rotation",
                "axis": [0, 0, 2],
                "minimum": -20,
                "maximum": 60,
            }
        ],
        v=[0.75],
        off=[0.5],
        edit=moved("sun", rotate([0, 0, 1], 40)),
    ),
    Update(
        "rotation of the sky",
        scene="field",
        variables=[
            {
                "object": "sky",
                "property": "rotation",
                "axis": [0, 1, 0],
                "minimum": 0,
                "maximum": 360,
            }
        ],
        v=[0.25],
        off=[0.35],
        edit=moved("sky", rotate([0, 1, 0], 90)),
    ),
]


def seen_from(origin, target, up=(0, 1, 0)):
    def edit(root) -> None:
        look_at = find(root, "camera").find("transform/lookat")
        for name, vector in (("origin", origin), ("target", target), ("up", up)):
            look_at.set(name, ", ".join(str(float(c)) for c in vector))

    return edit


VIEW = {"minimum": [-2, 1, 2, -0.5, 0.5, -1], "maximum": [2, 3, 4, 0.5, 0.5, 0]}
KEYS = [[0, 1, 4, 0, 1, 0], [1, 1.5, 3, 0, 1, 0], [1.5, 2, 2, 0.5, 0.5, 0], [0, 3, 3, 0, 1, 0]]

VIEWS = [
    Update(
        "look_at",
        variables=[{"object": "camera", "property": "look_at", **VIEW}],
        v=[0.75, 0.25, 0.5, 0.75, 0.5],
        off=[0.7, 0.25, 0.5, 0.75, 0.5],
        edit=seen_from([1, 1.5, 3], [0.25, 0.5, -0.5]),
    ),
    Update(
        "look_at with another up",
        scene="field",
        variables=[{"object": "camera", "property": "look_at", "up": [0.3, 1, 0], **VIEW}],
        v=[0.75, 0.25, 0.5, 0.75, 0.5],
        off=[0.7, 0.25, 0.5, 0.75, 0.5],
        edit=seen_from([1, 1.5, 3], [0.25, 0.5, -0.5], [0.3, 1, 0]),
    ),
    Update(
        "a camera that moves",
        variables=[
            {
                "object": "camera",
                "property": "translation",
                "minimum": [-1, 0, 0],
                "maximum": [1, 0, 0],
            }
        ],
        v=[0.75],
        off=[0.7],
        edit=seen_from([0.5, 1, 4], [0.5, 1, 0]),
    ),
    Update(
        "camera_path",
        scene="field",
        variables=[{"object": "camera", "property": "camera_path", "keys": KEYS}],
        v=[0.5],
        off=[0.45],
        # Lagrange's polynomial through four points, in their middle.
        edit=seen_from(
            *np.split(np.array([-1, 9, 9, -1]) / 16 @ np.array(KEYS, dtype=float), 2),
        ),
    ),
]


UPDATES = [*LIGHTS, *SUN_AND_SKY, *VIEWS]


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_update_equals_a_scene_written_with_the_value(update, make_scene) -> None:
    check_update(update, "scalar", make_scene)
