"""The variables of emitters and sensors."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from ngi.scene.kinds import LookAt, Radiance, Rotation
from ngi.scene.release.geometry import Box
from ngi.scene.release.objects import Objects
from ngi.scene.release.tags import Tags
from ngi.scene.variable import Variable

ENVIRONMENT_ANGLES = (100.0, 140.0)
"""Degrees about y between which the released renderer turns an environment map."""

_EMISSIONS = {
    "area": "radiance",
    "constant": "radiance",
    "directionalarea": "radiance",
    "point": "intensity",
    "spot": "intensity",
    "directional": "irradiance",
}


def emitter_variable(objects: Objects, emitter: Element, tags: Tags) -> Variable:
    """3 parameters: radiance; 1: the three numbers of it together.

    An environment map turns by 1 parameter; that replaces its authored to_world.
    """
    source, kind = objects.source, emitter.get("type", "")
    ids = objects.ids(emitter.attrib["id"])
    if kind == "envmap":
        if tags.count != 1:
            message = f"num_parameters is {tags.count}; an environment map turns, 1 parameter"
            raise source.error(emitter, message)
        for transform in emitter.findall("transform"):
            emitter.remove(transform)
        return Rotation(ids, ENVIRONMENT_ANGLES[:1], ENVIRONMENT_ANGLES[1:])
    if kind not in _EMISSIONS:
        known = ", ".join([*_EMISSIONS, "envmap"])
        raise source.error(emitter, f"an emitter '{kind}' does not vary; known: {known}")
    if tags.count not in (1, 3):
        message = "3 is radiance, 1 the three numbers of it together"
        raise source.error(emitter, f"num_parameters is {tags.count}; {message}")
    low, high = tags.ends(slice(3))
    for name in ids:
        _make_rgb(objects.by_id(name), _EMISSIONS[kind])
    return Radiance(ids, low, high, linked=tags.count == 1)


def sensor_variable(objects: Objects, sensor: Element, tags: Tags, box: Box) -> Variable:
    """5 parameters: origin in min_bounds + u * range_bounds, and x and z of the point looked at.

    The target lies in the middle third of the box along x and z and at a third of its height.
    box: of the scene as the file has it, without its variables.
    """
    if tags.count != 5:
        raise objects.source.error(
            sensor, f"num_parameters is {tags.count}; a sensor has 5: origin x, y, z, target x, z"
        )
    origin, farthest = tags.ends(slice(3))
    low, high = box
    third = (high - low) / 3
    near = low + third
    target = tuple(map(float, near))
    end = tuple(map(float, near + third * (1, 0, 1)))
    return LookAt((sensor.attrib["id"],), (*origin, *target), (*farthest, *end))


def _make_rgb(emitter: Element, name: str) -> None:
    """Gives the emission as a colour, which varies; another spectrum is replaced."""
    given = [child for child in emitter if child.get("name") == name]
    if [child.tag for child in given] != ["rgb"]:
        for child in given:
            emitter.remove(child)
        SubElement(emitter, "rgb", {"name": name, "value": "1, 1, 1"})
