"""What can be known of a Mitsuba scene file without Mitsuba: the files it names, and its hash."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree


@dataclass(frozen=True)
class SceneFile:
    """A Mitsuba XML file: the root element and the values of its <default>s."""

    path: Path
    root: ElementTree.Element
    defaults: dict[str, str]

    def value(self, element: ElementTree.Element, attribute: str = "value") -> str:
        """An attribute with every $name replaced by its default."""
        text = element.get(attribute, "")
        for name in sorted(self.defaults, key=len, reverse=True):
            text = text.replace(f"${name}", self.defaults[name])
        return text


def read_scene_file(path: Path) -> SceneFile:
    """Raises ValueError, naming the line, for broken XML and FileNotFoundError for no file."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such scene file; check the key 'scene' in scene.yaml")
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path}: not well-formed XML: {error}; correct the file there") from None
    defaults = {e.get("name", ""): e.get("value", "") for e in root.iter("default")}
    return SceneFile(path, root, defaults)


def named_files(scene: SceneFile) -> list[tuple[str, Path]]:
    """Every file the scene names, as (name in the XML, path), files of included XML too.

    Raises FileNotFoundError, with the name in the XML, for the first one that is missing.
    """
    files: list[tuple[str, Path]] = []
    for tag, element, attribute in file_references(scene):
        name = scene.value(element, attribute)
        path = scene.path.parent / name
        if not path.is_file():
            raise FileNotFoundError(
                f"{scene.path}: <{tag}> names '{name}', which is not there; "
                f"bring the file to {path} or correct the name"
            )
        files.append((name, path))
        if tag == "include":
            files += named_files(read_scene_file(path))
    return files


def file_references(
    scene: SceneFile,
) -> Iterator[tuple[str, ElementTree.Element, str]]:
    """Where files are named: the tag of what needs the file, and the element and attribute."""
    for element in scene.root.iter():
        if element.tag == "include":
            yield "include", element, "filename"
        for child in element:
            if child.tag == "string" and child.get("name") == "filename":
                yield element.tag, child, "value"


def integrator_max_depth(scene: SceneFile) -> int:
    """The authored max_depth; Mitsuba's default, -1 for no limit, where none is given.

    Raises ValueError for a scene without integrator, for a max_depth that is no integer, and for a
    scene that hides emitters: the picture and the emission buffer must both show them.
    """
    integrator = scene.root.find("integrator")
    if integrator is None:
        raise ValueError(f"{scene.path}: no <integrator>; add one, <integrator type='path'>")
    hidden = integrator.find("boolean[@name='hide_emitters']")
    if hidden is not None and scene.value(hidden) == "true":
        raise ValueError(f"{scene.path}: hide_emitters is true, set it to false: emitters show")
    depth = integrator.find("integer[@name='max_depth']")
    if depth is None:
        return -1
    value = scene.value(depth)
    try:
        return int(value)
    except ValueError:
        raise ValueError(
            f"{scene.path}: the integrator's max_depth is '{value}'; expected an integer, the one "
            "in scene.yaml"
        ) from None


def content_hash(contents: list[tuple[str, Path]]) -> str:
    """SHA-256 over names and bytes: the same wherever the scene's folder lies."""
    digest = hashlib.sha256()
    for name, path in sorted(set(contents)):
        data = path.read_bytes()
        digest.update(f"{name}\0{len(data)}\0".encode())
        digest.update(data)
    return digest.hexdigest()
