"""Lights, sky and camera that vary, against scenes written with their values."""

from xml.etree import ElementTree

import numpy as np
import pytest

from tests.scene.stage import about, find, moved, rotate, set_value
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


POINT = """<emitter type="point" id="bulb"><point name="position" x="0.5" y="1.5" z="0.5"/>
<rgb name="intensity" value="3, 2, 1"/></emitter>"""
SPOT = """<emitter type="spot" id="torch"><transform name="to_world">
<lookat origin="-0.5, 1.5, 1" target="0, 0.5, 0" up="0, 1, 0"/></transform>
<float name="cutoff_angle" value="30"/><rgb name="intensity" value="5, 9, 9"/></emitter>"""
BEAMER = """<emitter type="projector" id="beamer"><transform name="to_world">
<lookat origin="0, 1, 3" target="0, 1, 0" up="0, 1, 0"/></transform><float name="fov" value="20"/>
<texture type="bitmap" name="irradiance"><string name="filename" value="dots.png"/></texture>
<float name="scale" value="20"/></emitter>"""
MOVES = {"property": "translation", "minimum": [-1, -1, 0], "maximum": [1, 1, 0]}
AIMS = {"property": "direction", "minimum": [-60, 10], "maximum": [60, 70]}


def adding(*lights):
    return lambda root: root.extend(ElementTree.fromstring(light) for light in lights)


def aimed(object_id, origin, azimuth, elevation):
    """The edit that gives a light its place, and the direction that its light comes from."""
    a, e = np.radians([azimuth, elevation])
    towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])

    def edit(root) -> None:
        look_at = find(root, object_id).find("transform/lookat")
        look_at.set("origin", ", ".join(map(repr, map(float, origin))))
        look_at.set("target", ", ".join(map(repr, (np.array(origin) - towards).tolist())))

    return edit


def with_cone(root) -> None:
    spot = find(root, "torch")
    set_value(root, "torch", "cutoff_angle", "25.0")
    ElementTree.SubElement(spot, "float", name="beam_width", value="12.0")


LIGHTS_THAT_MOVE = [
    Update(
        "translation of a point light",
        before=adding(POINT),
        variables=[{"object": "bulb", **MOVES}],
        v=[0.25, 0.75],
        off=[0.25, 0.6],
        edit=lambda root: find(root, "bulb").find("point").attrib.update(x="0.0", y="2.0"),
    ),
    Update(
        "rotation of a point light about a pivot elsewhere",
        before=adding(POINT),
        variables=[
            {
                "object": "bulb",
                "property": "rotation",
                "axis": [0, 1, 0],
                "pivot": [0, 0, 0],
                "minimum": 0,
                "maximum": 180,
            }
        ],
        v=[0.5],
        off=[0.6],
        edit=lambda root: find(root, "bulb").find("point").attrib.update(x="0.5", z="-0.5"),
    ),
    Update(
        "place, direction and cone of a spot",
        before=adding(SPOT),
        variables=[
            {"object": "torch", **MOVES},
            {"object": "torch", **AIMS},
            {"object": "torch", "property": "cone", "minimum": [20, 4], "maximum": [30, 20]},
        ],
        v=[0.75, 0.25, 0.25, 0.5, 0.5, 0.5],
        off=[0.75, 0.25, 0.25, 0.5, 0.9, 0.9],
        edit=lambda root: (aimed("torch", [0, 1, 1], -30, 40)(root), with_cone(root)),
    ),
    Update(
        "rotation of a spot about its own place",
        before=adding(SPOT),
        variables=[
            {
                "object": "torch",
                "property": "rotation",
                "axis": [0, 1, 0],
                "minimum": -60,
                "maximum": 60,
            }
        ],
        v=[0.75],
        off=[0.6],
        edit=moved("torch", *about([-0.5, 1.5, 1], rotate([0, 1, 0], 30))),
    ),
    Update(
        "place, direction and intensity of a projector",
        before=adding(BEAMER),
        variables=[
            {"object": "beamer", **MOVES},
            {"object": "beamer", **AIMS},
            {"object": "beamer", **INTENSITY},
        ],
        v=[0.75, 0.75, 0.5, 0.25, 0.75],
        off=[0.75, 0.75, 0.5, 0.3, 0.75],
        edit=lambda root: (
            aimed("beamer", [0.5, 1.5, 3], 0, 25)(root),
            set_value(root, "beamer", "scale", "40"),
        ),
    ),
    Update(
        "fov",
        variables=[{"object": "camera", "property": "fov", "minimum": 20, "maximum": 60}],
        v=[0.75],
        off=[0.7],
        edit=lambda root: set_value(root, "camera", "fov", "50"),
    ),
]

UPDATES = [*LIGHTS, *SUN_AND_SKY, *VIEWS, *LIGHTS_THAT_MOVE]


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_update_equals_a_scene_written_with_the_value(update, make_scene) -> None:
    check_update(update, "scalar", make_scene)
