"""A document while it is rewritten: its ids, which objects each has become, and its shapes.

Mitsuba 3 cannot instance emitters. An instance of a group with emitting shapes is taken apart:
these become shapes of the scene, which follow the instance's variables beside what is left of it.
"""

import copy
from itertools import chain, count
from xml.etree.ElementTree import Element, SubElement

from ngi.scene.release.geometry import group_of
from ngi.scene.release.motion import Motion
from ngi.scene.release.source import Source
from ngi.scene.yaml_keys import Vector


class Objects:
    """Ids of a document. An element that is copied gets new ones, which are remembered.

    Every instance has an id.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.root = source.root
        objects = [e for e in self.root.iter() if e.tag != "ref"]
        self._used = {e.attrib["id"] for e in objects if "id" in e.attrib}
        self._became: dict[str, list[str]] = {}
        for instance in self.shapes("instance"):
            self.id_of(instance, like="instance")

    def shapes(self, kind: str) -> list[Element]:
        """The shapes of a type that are directly in the scene."""
        return [shape for shape in self.root.findall("shape") if shape.get("type") == kind]

    def instances(self, group: Element) -> list[Element]:
        return [e for e in self.shapes("instance") if group_of(self.source, e) is group]

    def by_id(self, object_id: str) -> Element:
        """Raises ValueError for an id that no object has."""
        for element in self.root.iter():
            if element.tag != "ref" and element.get("id") == object_id:
                return element
        raise ValueError(f"{self.source.document.path}: no object has the id '{object_id}'")

    def new_id(self, like: str) -> str:
        """An id that no object has yet: the one asked for, or with a number behind it."""
        numbered = chain([like], (f"{like}_{number}" for number in count(2)))
        name = next(name for name in numbered if name not in self._used)
        self._used.add(name)
        return name

    def id_of(self, element: Element, *, like: str) -> str:
        """The element's id. An element without an id gets a new one, similar to `like`."""
        if "id" not in element.attrib:
            element.set("id", self.new_id(like))
        return element.attrib["id"]

    def copy(self, element: Element) -> Element:
        """A copy of an element, with new ids. Messages name the lines of the original."""
        new = copy.deepcopy(element)
        self.source.note_copy(element, new)
        for child in new.iter():
            if child.tag != "ref" and "id" in child.attrib:
                old = child.attrib["id"]
                child.set("id", self.new_id(old))
                self._became.setdefault(old, [old]).append(child.attrib["id"])
        return new

    def replace(self, object_id: str, ids: list[str]) -> None:
        """Says that these objects stand for another one, which may be one of them."""
        self._became[object_id] = ids

    def ids(self, object_id: str) -> tuple[str, ...]:
        """All objects that stand for one of the file, itself included if it is still there."""
        became = self._became.get(object_id, [object_id])
        below = [(name,) if name == object_id else self.ids(name) for name in became]
        return tuple(chain.from_iterable(below))


def insert_after(root: Element, element: Element, new: list[Element]) -> None:
    """Puts elements behind another one of the root's."""
    index = list(root).index(element) + 1
    root[index:index] = new


def place_emitters(objects: Objects) -> None:
    """Puts emitters that shapes refer to into them, a copy into every shape but the first."""
    for emitter in objects.root.findall("emitter"):
        name = emitter.get("id", "")
        shapes = [shape for shape in objects.root.iter("shape") if _references(shape, name)]
        for shape in shapes:
            for ref in _references(shape, name):
                shape.remove(ref)
            shape.append(emitter if shape is shapes[0] else objects.copy(emitter))
        if shapes:
            objects.root.remove(emitter)
        elif emitter.get("type") == "area":
            message = "no shape has a <ref> to this area emitter; give one to a shape"
            raise objects.source.error(emitter, message)


def separate_emitters(objects: Objects) -> None:
    """Takes the groups with emitting shapes apart, whether or not their instances move."""
    for group in objects.shapes("shapegroup"):
        emitting = [member for member in group.findall("shape") if _emits(member)]
        instances = objects.instances(group)
        if not emitting or not instances:
            continue
        left = len(group.findall("shape")) > len(emitting)
        for instance in reversed(instances):  # the first one gets the originals
            first = instance is instances[0]
            shapes = [member if first else objects.copy(member) for member in emitting]
            _put_beside(objects, instance, shapes, left=left)
        for member in emitting:
            group.remove(member)
        if not left:
            objects.root.remove(group)


def apply_fixed_offsets(objects: Objects, motions: dict[str, Motion]) -> None:
    """Moves shapes whose offset does not vary; motions: by the id of the shape or instance."""
    for name, motion in motions.items():
        if motion.fixed_offset is not None:
            for object_id in objects.ids(name):
                _translate(objects.by_id(object_id), motion.fixed_offset)


def split_choice(objects: Objects, group: Element) -> tuple[str, ...]:
    """Makes every shape of a group one of its own; returns the ids of their instances."""
    name = group.attrib["id"]
    instances = objects.instances(group)
    if len(instances) != 1:
        message = f"{len(instances)} instances; a group that varies has one"
        raise objects.source.error(group, message)
    copies = [objects.copy(instances[0]) for _ in group.findall("shape")]
    for member, instance in zip(group.findall("shape"), copies, strict=True):
        own = SubElement(objects.root, "shape", {"type": "shapegroup", "id": objects.new_id(name)})
        own.append(member)
        for ref in _references(instance, name):
            ref.set("id", own.attrib["id"])
        objects.root.append(instance)
    ids = [instance.attrib["id"] for instance in copies]
    objects.replace(instances[0].attrib["id"], ids)
    objects.root.remove(instances[0])
    objects.root.remove(group)
    return tuple(ids)


def _emits(shape: Element) -> bool:
    return shape.find("emitter") is not None


def _references(shape: Element, name: str) -> list[Element]:
    return [ref for ref in shape.findall("ref") if ref.get("id") == name]


def _put_beside(objects: Objects, instance: Element, shapes: list[Element], *, left: bool) -> None:
    """Puts shapes of the instance's group into the scene, where the instance shows them."""
    name = instance.attrib["id"]
    ids = [name] if left else []
    for shape in shapes:
        shape.set("id", objects.new_id(f"{name}_emitter") if ids else name)
        ids.append(shape.attrib["id"])
        for step in instance.findall("transform[@name='to_world']/*"):
            _transform(shape).append(step)
    insert_after(objects.root, instance, shapes)
    if not left:
        objects.root.remove(instance)
    objects.replace(name, ids)


def _translate(shape: Element, offset: Vector) -> None:
    values = dict(zip("xyz", map(str, offset), strict=True))
    SubElement(_transform(shape), "translate", values)


def _transform(shape: Element) -> Element:
    found = shape.find("transform[@name='to_world']")
    return SubElement(shape, "transform", {"name": "to_world"}) if found is None else found
