"""The tags that make an element variable, with the defaults of the released renderer."""

from dataclasses import dataclass
from difflib import get_close_matches
from math import inf, nextafter
from xml.etree.ElementTree import Element

from ngi.scene.release.source import Source
from ngi.scene.xml_file import shown
from ngi.scene.yaml_keys import Vector

NAMES = (
    "num_parameters",
    "min_bounds",
    "range_bounds",
    "rotation_axis",
    "min_angle",
    "range_angle",
)

CLASSES = ("shape", "shapegroup", "emitter", "bsdf", "sensor")
"""What can vary, in the order of its components in v; instances are shapes."""


@dataclass(frozen=True)
class Tags:
    """What a variable element says; only shapes turn.

    count: how many components of v it takes.
    minimum, extent: [4] of the values, of which the fourth is a roughness.
    axis, min_angle, range_angle: of the rotation, in degrees.
    given: names of the tags that are there.
    """

    count: int
    minimum: Vector
    extent: Vector
    axis: Vector
    min_angle: float
    range_angle: float
    given: frozenset[str]

    def ends(self, part: slice) -> tuple[Vector, Vector]:
        """Minimum and maximum of some of the values.

        A number without a range takes a component all the same, since the file counts it: its
        maximum is the next number that there is.
        """
        low, extent = self.minimum[part], self.extent[part]
        return low, tuple(
            a + e if e else nextafter(a, inf) for a, e in zip(low, extent, strict=True)
        )


def is_variable(element: Element) -> bool:
    return element.tag != "ref" and element.get("id", "").startswith("var_")


def class_of(element: Element) -> str:
    """One of `CLASSES`, or the element's own tag."""
    return "shapegroup" if element.get("type") == "shapegroup" else element.tag


def take_tags(source: Source) -> dict[Element, Tags]:
    """The tags of every variable element, class by class and within one as in the file.

    All tags are taken out of the document. Those of elements whose id does not begin with 'var_'
    mean nothing. Raises ValueError for tags in what cannot vary.
    """
    found: dict[Element, Tags] = {}
    for element in list(source.root.iter()):
        if is_variable(element):
            _check(source, element)
            found[element] = _tags(source, element)
        elif taken := _take(source, element):
            if class_of(element) not in CLASSES:
                tag = next(iter(taken.values()))
                message = f"a tag in {shown(element)}; it belongs directly into {_varying()}"
                raise source.error(tag, message)
            source.warn(
                element,
                "it does not vary, since its id does not begin with 'var_'; ignored: "
                + ", ".join(sorted(taken)),
            )
    for element in source.root.iter("vector4f"):
        raise source.error(element, f"only tags are of this type: {', '.join(NAMES)}")
    _check_places(source, found)
    return dict(sorted(found.items(), key=lambda entry: CLASSES.index(class_of(entry[0]))))


def _take(source: Source, element: Element) -> dict[str, Element]:
    tags: dict[str, Element] = {}
    for child in [child for child in element if child.get("name") in NAMES]:
        if (first := tags.setdefault(child.attrib["name"], child)) is not child:
            raise source.error(child, f"{source.place(first)} has this tag already; take one out")
        element.remove(child)
    return tags


def _tags(source: Source, element: Element) -> Tags:
    taken = _take(source, element)

    def number(name: str, default: float) -> float:
        return source.number(taken[name]) if name in taken else default

    count = 5 if element.tag == "sensor" else 3
    if "num_parameters" in taken:
        count = source.integer(taken["num_parameters"])
    elif element.get("type") == "envmap":
        count = 1
    extent = _bounds(source, taken.get("range_bounds"), 1.0)
    if min(extent) < 0:
        _warn_of_negative(source, element, taken["range_bounds"])
    axis = source.vector(taken["rotation_axis"]) if "rotation_axis" in taken else (1.0, 1.0, 1.0)
    if not any(axis):
        raise source.error(taken["rotation_axis"], "give a direction, such as 0, 1, 0")
    return Tags(
        count=count,
        minimum=_bounds(source, taken.get("min_bounds"), 0.0),
        extent=extent,
        axis=axis,
        min_angle=number("min_angle", 0.0),
        range_angle=number("range_angle", 360.0),
        given=frozenset(taken),
    )


def _warn_of_negative(source: Source, element: Element, tag: Element) -> None:
    if class_of(element) == "shape":
        meaning = "a shape does not move along that axis, and a component too many turns it"
    else:
        meaning = "the value falls from min_bounds, where v is 0, to the smaller one, where v is 1"
    source.warn(
        tag,
        f"a negative number: {meaning}; write minimum and positive range where that is not meant",
    )


def _bounds(source: Source, element: Element | None, default: float) -> Vector:
    if element is None:
        return (default,) * 4
    if "value" in element.attrib and len(values := source.numbers(element)) == 4:
        return values
    return (*source.vector(element), default)


def _check(source: Source, element: Element) -> None:
    """Finds tags that are none, such as 'max_bounds', and elements that cannot vary."""
    if class_of(element) not in CLASSES:
        raise source.error(element, f"an id that begins with 'var_' belongs to {_varying()}")
    for child in element:
        name = child.get("name", "")
        alike = name.startswith(("num_", "min_", "max_", "range_")) or name.endswith("_bounds")
        if name not in NAMES and (alike or get_close_matches(name, NAMES, n=1, cutoff=0.75)):
            near = get_close_matches(name, NAMES, n=1, cutoff=0)[0]
            known = ", ".join(NAMES)
            raise source.error(child, f"no tag (did you mean '{near}'?); known: {known}")


def _varying() -> str:
    """What can vary, for people."""
    return "one of " + ", ".join(f"<{name}>" for name in CLASSES if name != "shapegroup")


def _check_places(source: Source, found: dict[Element, Tags]) -> None:
    for group in source.root.iter("shape"):
        for member in group.findall("shape"):
            if member in found:
                raise source.error(
                    member, "a shape in a shapegroup does not vary; make its <instance> variable"
                )
