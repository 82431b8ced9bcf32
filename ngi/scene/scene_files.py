"""What is known of a Mitsuba scene file without Mitsuba: what it names and may read, its hash."""

from __future__ import annotations

import copy
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree

from ngi.scene.xml_file import Lines, parse_xml, remove_defaults, replace_names

ASSETS = "NGI_ASSETS"
"""Environment variable: further folders that scenes may read from, as in PATH."""


def allowed_file(folder: Path, name: str, *, within: Path, where: str) -> Path:
    """The file that a scene names, counted from `folder`.

    within: the scene's folder, which it has to lie in once symlinks are followed, or else in one
        of those in $NGI_ASSETS. where: the file and the key that name it, for the message.

    Raises ValueError for a file elsewhere, and FileNotFoundError where there is no regular file.
    """
    path = folder / name
    try:
        real, exists = path.resolve(), path.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # NUL, too long, symlinks in a circle
        raise ValueError(f"{where} names {name[:80]!r}, which is no file: {error}") from None
    if not any(real.is_relative_to(place) for place in (within.resolve(), *_assets())):
        raise ValueError(
            f"{where} names '{name}', which is {real}, outside of the scene's folder {within}; "
            f"copy it there or, if you trust the scene, set {ASSETS}={real.parent}"
        )
    if not exists:
        raise FileNotFoundError(
            f"{where} names '{name}', which does not exist; put the file at {path} or correct the "
            "name"
        )
    return path


def _assets() -> list[Path]:
    return [Path(part).resolve() for part in os.environ.get(ASSETS, "").split(os.pathsep) if part]


NamedFile = tuple[str, Path]


MOST_INCLUDES = 100

PATH_TRACERS = ("path", "volpath", "volpathmis")
"""Mitsuba's integrators whose pictures can be trained on."""


@dataclass(frozen=True)
class SceneFile:
    """A Mitsuba XML file, with its <default>s and <include>s replaced by what they stand for.

    root: every file in it is named from the folder of `path`.
    included: names and paths of the XML files that it includes.
    places: file and line where elements begin, as messages have them; not of those added since.
    """

    path: Path
    root: ElementTree.Element
    included: tuple[NamedFile, ...] = ()
    places: dict[ElementTree.Element, str] = field(default_factory=dict, compare=False)

    def copied(self) -> SceneFile:
        """With a root of its own."""
        root = copy.deepcopy(self.root)
        pairs = zip(self.root.iter(), root.iter(), strict=True)
        places = {new: self.places[old] for old, new in pairs if old in self.places}
        return replace(self, root=root, places=places)


def read_scene_file(path: Path, *, within: Path | None = None) -> SceneFile:
    """A Mitsuba XML file and those that it includes.

    within: the folder whose files it may name, see `ngi.scene.scene_files`; its own where None.

    Raises FileNotFoundError for a file that is not there, and ValueError for broken XML and for
    files that it must not read, both with what to do.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such scene file; check the key 'scene' in scene.yaml")
    within = within or path.parent
    root, lines = parse_xml(path)
    places, home = element_places(path, lines), path.parent
    folders: dict[ElementTree.Element, tuple[Path, ...]] = dict.fromkeys(lines, (home,))
    included: list[NamedFile] = []
    defaults: dict[str, str] = {}
    replace_names(root, defaults, place=places[root])
    pending = [(root, child) for child in reversed(root)]
    while pending:  # in document order, as Mitsuba: an included file may have <default>s too
        parent, element = pending.pop()
        replace_names(element, defaults, place=places[element])
        if element.tag != "include":
            pending += [(element, child) for child in reversed(element)]
            continue
        name = _found(element.get("filename", ""), folders[element], home=home)
        if len(included) >= MOST_INCLUDES:
            raise ValueError(f"{path}: <include> of '{name}': more than {MOST_INCLUDES}, or a loop")
        where = f"{places[element]}: <include>"
        included.append((name, allowed_file(home, name, within=within, where=where)))
        content, lines = parse_xml(file := home / name)
        places |= element_places(file, lines)
        folders |= dict.fromkeys(lines, (file.parent, *folders[element]))
        index = list(parent).index(element)
        parent[index : index + 1] = list(content)
        pending += [(parent, child) for child in reversed(content)]
    remove_defaults(root)
    for _, element, attribute in file_references(root):
        name = _found(element.get(attribute, ""), (home, *folders[element]), home=home)
        element.set(attribute, name)
    scene = SceneFile(path, root, tuple(included), places)
    check_files(scene, within=within)
    return scene


def _found(name: str, folders: tuple[Path, ...], *, home: Path) -> str:
    """What an XML file names, as a name from the scene's folder, its home.

    folders: where it is looked for, in turn. Mitsuba looks for an included file beside the one
        that includes it, and so on outwards, but for any other file in the scene's folder alone;
        what is not there, but beside the included file, is found as well.
    """
    folder = next((folder for folder in folders if os.path.isfile(folder / name)), home)
    return name if folder == home else os.path.relpath(folder / name, home)


def element_places(path: Path, lines: Lines) -> dict[ElementTree.Element, str]:
    """`SceneFile.places` of one file's elements."""
    return {element: f"{path}, line {line}" for element, line in lines.items()}


def check_files(scene: SceneFile, *, within: Path) -> None:
    """Finds files that are not there, all of them, or must not be read."""
    missing = []
    for tag, element, attribute in file_references(scene.root):
        where = f"{scene.places[element]}: <{tag}>"
        name = element.get(attribute, "")
        try:
            allowed_file(scene.path.parent, name, within=within, where=where)
        except FileNotFoundError as error:
            missing.append(str(error))
    if missing:
        raise FileNotFoundError("; ".join(missing))
    for element, place in scene.places.items():
        value, name = element.get("value", ""), element.get("name", "")
        if element.tag == "path":
            problem = "<path>: take it out; files are named from the folder of this one"
        elif element.tag == "string" and name != "filename" and {"/", "\\"} & set(value):
            problem = f"<string name='{name}'> is '{value}'; only 'filename' names a file"
        else:
            continue
        raise ValueError(f"{place}: {problem}")


def named_files(scene: SceneFile) -> list[NamedFile]:
    """Every file the scene names, as (name in the XML, path), files of included XML too."""
    names = [element.get(attribute, "") for _, element, attribute in file_references(scene.root)]
    return [*scene.included, *((name, scene.path.parent / name) for name in names)]


def file_references(
    root: ElementTree.Element,
) -> Iterator[tuple[str, ElementTree.Element, str]]:
    """Where files are named: the tag of what needs the file, and the element and attribute."""
    for element in root.iter():
        if "filename" in element.attrib or element.tag == "include":
            yield element.tag, element, "filename"
        for child in element:
            if child.tag == "string" and child.get("name") == "filename":
                yield element.tag, child, "value"


def integrator_max_depth(scene: SceneFile) -> int:
    """The authored max_depth; Mitsuba's default, -1 for no limit, where none is given.

    Raises ValueError for a scene without integrator or with one that is no path tracer, for a
    max_depth that is no integer, and for a scene that hides emitters: the picture and the emission
    buffer must both show them.
    """
    integrator = _path_tracer(scene)
    hidden = _given(integrator, "boolean", "hide_emitters", "hideEmitters")
    if hidden is not None and hidden.get("value", "").lower() == "true":
        raise ValueError(f"{scene.path}: hide_emitters is true, set it to false: emitters show")
    depth = _given(integrator, "integer", "max_depth", "maxDepth")
    if depth is None:
        return -1
    value = depth.get("value", "")
    try:
        return int(value)
    except ValueError:
        raise ValueError(
            f"{scene.path}: the integrator's max_depth is '{value}'; expected an integer, the one "
            "in scene.yaml"
        ) from None


def _given(integrator: ElementTree.Element, tag: str, *names: str) -> ElementTree.Element | None:
    """A property by its name, or by that in files of versions before 1.0."""
    return next((each for each in integrator.findall(tag) if each.get("name") in names), None)


def _path_tracer(scene: SceneFile) -> ElementTree.Element:
    """The integrator, or the one in an `aov`."""
    given = scene.root.find("integrator")
    if given is None:
        raise ValueError(f"{scene.path}: no <integrator>; add one, <integrator type='path'>")
    inside = (each for each in given.iter("integrator") if each.get("type") != "aov")
    integrator = next(inside, given)
    if (kind := integrator.get("type")) not in PATH_TRACERS:
        raise ValueError(
            f"{scene.places.get(integrator, scene.path)}: <integrator type='{kind}'>: pictures are "
            f"made by a path tracer here; take one of {', '.join(PATH_TRACERS)}"
        )
    return integrator


def content_hash(contents: list[tuple[str, Path]]) -> str:
    """SHA-256 over names and bytes: the same wherever the scene's folder lies."""
    digest = hashlib.sha256()
    for name, path in sorted(set(contents)):
        data = path.read_bytes()
        digest.update(f"{name}\0{len(data)}\0".encode())
        digest.update(data)
    return digest.hexdigest()
