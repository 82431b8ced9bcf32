"""Reads a scene folder: `scene.yaml` beside a stock Mitsuba 3 `scene.xml`.

Everything that can be wrong in either is found here, before Mitsuba is even imported.
"""

import json
from dataclasses import replace
from difflib import get_close_matches
from hashlib import sha256
from pathlib import Path
from typing import Any

from ngi.files.resources import scene_folders
from ngi.scene.description import (
    HARD_FRAMES,
    PATH_FRAMES,
    SceneDescription,
    component_names,
    spread_frames,
)
from ngi.scene.kinds import KINDS
from ngi.scene.offered import advice
from ngi.scene.scene_files import (
    allowed_file,
    content_hash,
    integrator_max_depth,
    named_files,
    read_scene_file,
)
from ngi.scene.variable import Variable
from ngi.scene.yaml_keys import Vector, YamlKeys, load_yaml

_SAME_THING = {"camera_path": "look_at", "texels": "texture"}
"""Kinds that set what another kind sets."""


def read_scene(folder: Path | str, *, dimensions: int | None = None) -> SceneDescription:
    """Reads and checks a scene folder.

    Where scene.yaml gives no camera_path or hard_frames, they are spread over the hypercube.

    dimensions: a variant that scene.yaml names: only so many components of v vary, the first ones;
        the other variables stay as scene.xml has them.

    Raises FileNotFoundError for a missing folder or file, ValueError for anything else that is
    wrong; the message names file, key and value and says what to do.
    """
    folder = Path(folder)
    path = folder / "scene.yaml"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; a scene is a folder with a scene.yaml")
    allowed_file(folder, path.name, within=folder, where=str(folder))
    top = YamlKeys(path, "", load_yaml(path))
    scene_file = _file(top, "scene", top.take("scene", str))
    xml = read_scene_file(scene_file, within=folder)
    variables = _variables(top)
    complete = len(component_names(variables))
    variants = top.integers("variants") if "variants" in top else []
    bounds = YamlKeys(path, "bounds.", top.take("bounds", dict))
    low, high = (bounds.numbers(key, length=3) for key in ("minimum", "maximum"))
    bounds.check_range(low, high, strict=True)
    bounds.finish()
    beside = [(name, _file(top, "variables", name)) for v in variables for name in v.files]
    contents = [("scene.yaml", path), (scene_file.name, scene_file), *named_files(xml), *beside]
    description = SceneDescription(
        name=top.take("name", str),
        document=xml,
        samples_per_pixel=top.positive_integer("samples_per_pixel"),
        max_depth=_max_depth(top),
        bounds=(low, high),
        variables=variables,
        camera_path=_frames(top, "camera_path", PATH_FRAMES, complete),
        hard_frames=_frames(top, "hard_frames", HARD_FRAMES, complete),
        scene_hash=content_hash(contents),
        rendered_hash=_rendered_hash(top.values, content_hash(contents[1:])),
    )
    top.finish()
    if (authored := integrator_max_depth(xml)) != description.max_depth:
        raise ValueError(
            f"{path}: max_depth is {description.max_depth}, but {authored} in the integrator of "
            f"{scene_file}; make them equal, so that any Mitsuba renders the same picture"
        )
    for variant in variants:
        _first(description, variant, path)
    return description if dimensions is None else _first(description, dimensions, path)


def _rendered_hash(description: dict[str, Any], files: str) -> str:
    """files: hash of all but scene.yaml, whose keys and values are the description."""
    rendered = {key: description[key] for key in ("scene", "max_depth", "bounds", "variables")}
    return sha256(json.dumps([rendered, files], sort_keys=True).encode()).hexdigest()


def scenes() -> dict[str, dict[str, Any]]:
    """The scenes that are known by name: name -> arguments of `read_scene`.

    A scene with variants is known by their names only. A scene.yaml that cannot be read is listed
    all the same: what is wrong with it is said when it is asked for.
    """
    options: dict[str, dict[str, Any]] = {}
    for name, folder in scene_folders().items():
        counts: list[int | None] = [*_variants(folder / "scene.yaml")] or [None]
        for count in counts:
            option = name if count is None else f"{name}-{count}"
            options[option] = {"folder": str(folder), "dimensions": count}
    return options


def _variants(path: Path) -> list[int]:
    """Read only where the word is there: every command asks this of every scene."""
    try:
        if b"variants" not in path.read_bytes():
            return []
        top = YamlKeys(path, "", load_yaml(path))
        return top.integers("variants") if "variants" in top else []
    except (OSError, ValueError):
        return []


def _first(scene: SceneDescription, dimensions: int, path: Path) -> SceneDescription:
    """The variant of a scene in which only the first components of v vary."""
    for count in range(len(scene.variables) + 1):
        if len(component_names(scene.variables[:count])) == dimensions > 0:
            return replace(
                scene,
                name=f"{scene.name}-{dimensions}",
                variables=scene.variables[:count],
                camera_path=tuple(v[:dimensions] for v in scene.camera_path),
                hard_frames=tuple(v[:dimensions] for v in scene.hard_frames),
            )
    raise ValueError(
        f"{path}: variants: {dimensions} components are no whole number of the first variables"
    )


def _max_depth(top: YamlKeys) -> int:
    depth: int = top.take("max_depth", int)
    if depth < 1 and depth != -1:
        raise top.error("max_depth", depth, "expected a positive integer, or -1 for no limit")
    return depth


def _file(top: YamlKeys, key: str, name: str) -> Path:
    folder = top.path.parent
    return allowed_file(folder, name, within=folder, where=f"{top.path}: {key}")


def _frames(top: YamlKeys, key: str, count: int, dimensions: int) -> tuple[Vector, ...]:
    return (
        top.frames(key, dimensions=dimensions) if key in top else spread_frames(count, dimensions)
    )


def _variables(top: YamlKeys) -> tuple[Variable, ...]:
    entries = top.take("variables", list)
    if not entries:
        raise top.error("variables", entries, "name at least one")
    variables = tuple(_variable(top.path, i, entry) for i, entry in enumerate(entries))
    varied = [
        (name, _SAME_THING.get(variable.kind, variable.kind))
        for variable in variables
        for name in variable.objects
    ]
    for pair in varied:
        if varied.count(pair) > 1 and pair[1] not in ("rotation", "scale"):
            raise top.error("variables", ".".join(pair), "it is there twice; make it one entry")
    names = component_names(variables)
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise top.error("variables", twice, "two components have this name")
    return variables


def _variable(path: Path, index: int, entry: Any) -> Variable:
    keys = YamlKeys(path, f"variables[{index}].", entry)
    kind = keys.take("property", str)
    if kind not in KINDS:
        near = get_close_matches(kind, KINDS, n=1)
        meant = f" (did you mean '{near[0]}'?)" if near else ""
        known = f"choose one of {list(KINDS)}{meant}"
        raise keys.error("property", kind, advice(kind) or known)
    variable = KINDS[kind].read(keys.names("object", at_least=1), keys)
    if not variable.components:
        raise keys.error("maximum", entry["maximum"], "it equals minimum, so that nothing varies")
    keys.finish()
    return variable
