"""What a scene folder says: `scene.yaml` beside a stock Mitsuba 3 `scene.xml`.

Everything that can be wrong in either is found here, before Mitsuba is even imported.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ngi.scene.properties import PROPERTIES
from ngi.scene.scene_files import (
    content_hash,
    integrator_max_depth,
    named_files,
    read_scene_file,
)
from ngi.scene.variables import Variable, component_names
from ngi.scene.yaml_keys import Vector, YamlKeys, load_yaml


@dataclass(frozen=True)
class SceneDescription:
    """A variable scene as its folder describes it.

    samples_per_pixel: of training patches.
    max_depth: longest path in vertices, as Mitsuba counts; equal to the one in scene.xml.
    bounds_minimum, bounds_maximum: world-space box over the whole range of the variables, which
        normalises positions (the scene's own box moves with the variables).
    camera_path: key frames of v, each of length D. hard_frames: the test frames, likewise.
    scene_hash: hash of the contents of both files and of every file that the XML names.
    """

    name: str
    scene_file: Path
    samples_per_pixel: int
    max_depth: int
    bounds_minimum: Vector
    bounds_maximum: Vector
    variables: tuple[Variable, ...]
    camera_path: tuple[Vector, ...]
    hard_frames: tuple[Vector, ...]
    scene_hash: str

    @property
    def dimensions(self) -> int:
        """D, the number of components of v."""
        return len(self.component_names)

    @property
    def component_names(self) -> tuple[str, ...]:
        return component_names(self.variables)


def read_scene(folder: Path | str) -> SceneDescription:
    """Reads and checks a scene folder.

    Raises FileNotFoundError for a missing folder or file, ValueError for anything else that is
    wrong; the message names file, key and value and says what to do.
    """
    folder = Path(folder)
    path = folder / "scene.yaml"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; a scene is a folder with a scene.yaml")
    top = YamlKeys(path, "", load_yaml(path))
    scene_file = folder / top.take("scene", str)
    xml = read_scene_file(scene_file)
    variables = _variables(top)
    dimensions = len(component_names(variables))
    bounds = YamlKeys(path, "bounds.", top.take("bounds", dict))
    low, high = (bounds.numbers(key, length=3) for key in ("minimum", "maximum"))
    bounds.check_range(low, high)
    bounds.finish()
    contents = [("scene.yaml", path), (scene_file.name, scene_file), *named_files(xml)]
    description = SceneDescription(
        name=top.take("name", str),
        scene_file=scene_file,
        samples_per_pixel=top.positive_integer("samples_per_pixel"),
        max_depth=top.positive_integer("max_depth"),
        bounds_minimum=low,
        bounds_maximum=high,
        variables=variables,
        camera_path=top.frames("camera_path", dimensions=dimensions),
        hard_frames=top.frames("hard_frames", dimensions=dimensions),
        scene_hash=content_hash(contents),
    )
    top.finish()
    if (authored := integrator_max_depth(xml)) != description.max_depth:
        raise ValueError(
            f"{path}: max_depth is {description.max_depth}, but {authored} in the integrator of "
            f"{scene_file}; make them equal, so that any Mitsuba renders the same picture"
        )
    return description


def _variables(top: YamlKeys) -> tuple[Variable, ...]:
    entries = top.take("variables", list)
    if not entries:
        raise top.error("variables", entries, "name at least one")
    variables = tuple(_variable(top.path, i, entry) for i, entry in enumerate(entries))
    varied = [(variable.object, variable.property) for variable in variables]
    for pair in varied:
        if varied.count(pair) > 1:
            raise top.error("variables", ".".join(pair), "it is there twice; make it one entry")
    return variables


def _variable(path: Path, index: int, entry: Any) -> Variable:
    keys = YamlKeys(path, f"variables[{index}].", entry)
    name = keys.take("property", str)
    if name not in PROPERTIES:
        raise keys.error("property", name, f"choose one of {list(PROPERTIES)}{_near(name)}")
    axes = keys.take("axes", str) if "axes" in keys else None
    try:
        length = len(PROPERTIES[name].components(axes))
    except ValueError as error:
        raise ValueError(f"{path}: variables[{index}].{error}") from None
    low, high = (keys.numbers(key, length=length) for key in ("minimum", "maximum"))
    keys.check_range(low, high)
    smallest, largest = PROPERTIES[name].limits
    for key, values in (("minimum", low), ("maximum", high)):
        if not all(smallest <= value <= largest for value in values):
            raise keys.error(key, list(values), f"{name} lies between {smallest} and {largest}")
    variable = Variable(
        object=keys.take("object", str), property=name, minimum=low, maximum=high, axes=axes
    )
    keys.finish()
    return variable


def _near(name: str) -> str:
    near = get_close_matches(name, PROPERTIES, n=1)
    return f" (did you mean '{near[0]}'?)" if near else ""
