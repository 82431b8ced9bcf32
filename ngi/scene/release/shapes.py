"""Rewrites shapes and groups so that Mitsuba 3 takes them and can move them.

Mitsuba 3 cannot instance emitters. An instance of a group with emitting shapes is taken apart:
these become shapes of the scene, which follow the instance's variables beside what is left of it.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from ngi.scene.release.motion import Motion
from ngi.scene.release.objects import Objects, insert_after
from ngi.scene.yaml_keys import Vector


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
            raise objects.source.error(emitter, "no shape has a <ref> to this area emitter")


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
