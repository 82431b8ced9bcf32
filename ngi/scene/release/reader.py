"""Reads a scene in the tagged format of the paper's released program."""

from hashlib import sha256
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ngi.scene.description import (
    HARD_FRAMES,
    PATH_FRAMES,
    SceneDescription,
    component_names,
    spread_frames,
)
from ngi.scene.release.geometry import Box, scene_box
from ngi.scene.release.kinds import NOTHING, Alternatives
from ngi.scene.release.motion import Motion, motion_of
from ngi.scene.release.objects import (
    Objects,
    apply_fixed_offsets,
    place_emitters,
    separate_emitters,
    split_choice,
)
from ngi.scene.release.source import Source, read_source
from ngi.scene.release.tags import Tags, class_of, take_tags
from ngi.scene.release.variables import bsdf_variables, emitter_variable, hoist, sensor_variable
from ngi.scene.scene_files import SceneFile, content_hash, integrator_max_depth, named_files
from ngi.scene.variable import RangedVariable, Variable

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
        elif name == "hide_emitters" and value.lower() == "true":
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
        vertical = {"y": True, "smaller": height < width, "larger": height > width}
        kept = "its height" if vertical.get(_fov_axis(sensor)) else "its width"
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


RULES_VERSION = 3
"""Counts changes of how the tags are read: references of a scene read otherwise are not reused."""


def read_release(path: Path | str) -> SceneDescription:
    """A variable scene from the authors' own files: Mitsuba 2 XML whose elements are tagged.

    path: the folder of a scene.xml, or an XML file. The scene is named after the folder.

    Elements whose ids begin with 'var_' vary, in the order shapes and instances, shapegroups,
    emitters, BSDFs, sensors, and within one of these as in the file. In memory the document becomes
    stock Mitsuba 3. The camera's target counts from the scene's box as authored, as in the
    released renderer; `bounds` is the box over the whole range of the variables.

    The format has no test frames: `hard_frames` are ten points of a Halton sequence, always the
    same, and `camera_path` is the first six of them.

    Raises FileNotFoundError for files that are not there and ValueError, with file, line and
    element, for anything else that is wrong.
    """
    path = Path(path)
    source = read_source(path / "scene.xml" if path.is_dir() else path)
    tags = take_tags(source)
    if not tags:
        raise source.error(source.root, "nothing varies: no id begins with 'var_'")
    motions = {e: motion_of(source, e, t) for e, t in tags.items() if class_of(e) == "shape"}
    still = scene_box(source, {})
    low, high = scene_box(source, motions)
    rewrite_integrator(source)
    samples = rewrite_sensor(source)
    variables = _rewrite(source, tags, motions, still)
    frames = spread_frames(HARD_FRAMES, len(component_names(variables)))
    document = source.document
    contents = sha256(f"{RULES_VERSION} {_contents_hash(document)}".encode()).hexdigest()
    return SceneDescription(
        name=document.path.resolve().parent.name,
        document=document,
        samples_per_pixel=samples,
        max_depth=integrator_max_depth(document),
        bounds=(tuple(map(float, low)), tuple(map(float, high))),
        variables=variables,
        camera_path=frames[:PATH_FRAMES],
        hard_frames=frames,
        scene_hash=contents,
        rendered_hash=contents,
    )


def _contents_hash(document: SceneFile) -> str:
    return content_hash([(document.path.name, document.path), *named_files(document)])


def _rewrite(
    source: Source, tags: dict[Element, Tags], motions: dict[Element, Motion], still: Box
) -> tuple[Variable, ...]:
    """Makes the document stock Mitsuba 3; returns the variables of its objects."""
    objects = Objects(source)
    moved = {element.attrib["id"]: motion for element, motion in motions.items()}
    hoist(objects)
    place_emitters(objects)
    choices: list[Variable] = []
    for group in (element for element in tags if class_of(element) == "shapegroup"):
        if tags[group].count != 1:
            message = f"num_parameters is {tags[group].count}; a group has 1, the shape shown"
            raise source.error(group, message)
        shown = split_choice(objects, group)
        choices.append(Alternatives((group.attrib["id"],), (*shown, NOTHING)))
    separate_emitters(objects)
    apply_fixed_offsets(objects, moved)
    variables: list[Variable] = []
    for name, motion in moved.items():
        variables += motion.variables(objects.ids(name))
    variables += choices
    for element, element_tags in tags.items():
        made: list[Variable] = []
        match class_of(element):
            case "emitter":
                made = [emitter_variable(objects, element, element_tags)]
            case "bsdf":
                made = bsdf_variables(objects, element, element_tags)
            case "sensor":
                made = [sensor_variable(objects, element, element_tags, still)]
        for variable in made:
            _warn_of_values(source, element, variable)
        variables += made
    return tuple(variables)


def _warn_of_values(source: Source, element: Element, variable: Variable) -> None:
    """Of an albedo above 1, for example: the file is read as it is."""
    if not isinstance(variable, RangedVariable):
        return
    low, high = variable.limits
    if not all(low <= value <= high for value in (*variable.minimum, *variable.maximum)):
        source.warn(element, f"{variable.kind} {variable.range}, out of {low:g} to {high:g}")
