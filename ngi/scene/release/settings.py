"""Rewrites integrator, film and sampler as stock Mitsuba 3 and this project want them."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from ngi.scene.release.source import Source

DEFAULT_SAMPLES = 4
DEFAULT_FILM = {"width": 768, "height": 576}
"""What Mitsuba takes where the file says nothing."""


def rewrite_integrator(source: Source) -> None:
    """Takes the integrator out of an `aov` one, whose buffers this project makes itself.

    Emitters are seen by the camera, in the picture as in the emission buffer.
    """
    integrator = source.root.find("integrator")
    if integrator is None:
        raise source.error(source.root, "no <integrator>; add one, <integrator type='path'>")
    while integrator.get("type") == "aov":
        inner = integrator.find("integrator")
        if inner is None:
            raise source.error(integrator, "it makes buffers only; put a path tracer into it")
        index = list(source.root).index(integrator)
        source.root[index] = inner
        integrator = inner
    integrator.attrib.pop("name", None)
    for child in list(integrator):
        name, value = child.get("name"), child.get("value", "")
        if name == "samples_per_pass":
            integrator.remove(child)
        elif name == "hide_emitters" and value == "true":
            source.warn(child, "they are shown all the same")
            child.set("value", "false")
        elif name == "max_depth":
            source.integer(child)


def rewrite_sensor(source: Source) -> int:
    """Makes the film square and returns the sampler's samples per pixel."""
    sensor = source.root.find("sensor")
    if sensor is None:
        raise source.error(source.root, "no <sensor>; add a perspective camera")
    film = sensor.find("film")
    if film is None:
        film = SubElement(sensor, "film", {"type": "hdrfilm"})
    size = {name: _size(source, film, name) for name in ("width", "height")}
    width, height = (source.integer(element) for element in size.values())
    if width != height:
        kept = "its height" if _fov_axis(sensor) == "y" else "its width"
        source.warn(
            film,
            f"{width} x {height} pixels; it becomes square, with the field of view of {kept}",
        )
        size["height"].set("value", str(width))
    samples = sensor.find("sampler/integer[@name='sample_count']")
    return DEFAULT_SAMPLES if samples is None else _positive(source, samples)


def _size(source: Source, film: Element, name: str) -> Element:
    found = film.find(f"integer[@name='{name}']")
    if found is None:
        value = str(DEFAULT_FILM[name])
        return SubElement(film, "integer", {"name": name, "value": value})
    _positive(source, found)
    return found


def _positive(source: Source, element: Element) -> int:
    value = source.integer(element)
    if value < 1:
        raise source.error(element, "expected a positive number")
    return value


def _fov_axis(sensor: Element) -> str:
    axis = sensor.find("string[@name='fov_axis']")
    return "x" if axis is None else axis.get("value", "")
