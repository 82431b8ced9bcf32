"""The variables of BSDFs, emitters and sensors, and what the document needs for them."""

from math import inf, nextafter
from xml.etree.ElementTree import Element, SubElement

from ngi.scene.kinds import Albedo, LookAt, Material, Radiance, Rotation, Roughness
from ngi.scene.release.geometry import Box
from ngi.scene.release.kinds import SpecularReflectance, Tint
from ngi.scene.release.objects import Objects
from ngi.scene.release.tags import Tags, is_variable
from ngi.scene.variable import Variable

_COLOURS = {
    "diffuse": "reflectance",
    "plastic": "diffuse_reflectance",
    "roughplastic": "diffuse_reflectance",
    "conductor": "specular_reflectance",
    "roughconductor": "specular_reflectance",
    "dielectric": "specular_reflectance",
    "thindielectric": "specular_reflectance",
    "roughdielectric": "specular_reflectance",
    "principled": "base_color",
}
_ROUGHNESS = {
    "roughplastic": "alpha",
    "roughconductor": "alpha",
    "roughdielectric": "alpha",
    "principled": "roughness",
}


def hoist(objects: Objects) -> None:
    """Moves variable BSDFs that stand in a shape to the scene's top level."""
    for shape in list(objects.root.iter("shape")):
        for bsdf in shape.findall("bsdf"):
            if any(is_variable(element) for element in bsdf.iter("bsdf")):
                index = list(shape).index(bsdf)
                shape[index] = Element("ref", {"id": objects.id_of(bsdf, like="bsdf")})
                objects.root.insert(0, bsdf)


def bsdf_variables(objects: Objects, bsdf: Element, tags: Tags) -> list[Variable]:
    """3 parameters: colour; 1: roughness of a rough BSDF, texture of another; 4: both.

    A colour replaces the authored one, but it is a factor on a bitmap.
    """
    inner = _inner(bsdf)
    kind = inner.get("type", "")
    if kind not in _COLOURS:
        known = ", ".join(_COLOURS)
        raise objects.source.error(bsdf, f"a '{kind}' does not vary; known: {known}")
    if tags.count not in (1, 3, 4):
        raise objects.source.error(
            bsdf,
            f"num_parameters is {tags.count}; 3 is colour, 1 the roughness of a rough BSDF or the "
            "texture of another, 4 both",
        )
    if kind in _ROUGHNESS:
        colour = [_colour(objects, bsdf, tags)] if tags.count > 1 else []
        return [*colour, _roughness(bsdf, inner, tags)] if tags.count != 3 else colour
    choice = [_choice(objects, bsdf)] if tags.count != 3 else []  # before the colour: it copies
    return [_colour(objects, bsdf, tags), *choice] if tags.count > 1 else [*choice]


def _colour(objects: Objects, bsdf: Element, tags: Tags) -> Variable:
    ids = objects.ids(bsdf.attrib["id"])
    low, high = tags.ends(slice(3))
    inners = [_inner(objects.by_id(name)) for name in ids]
    given = [_reflectances(inner) for inner in inners]
    textured = [[_texture(objects, element) for element in elements] for elements in given]
    if any(texture is not None for textures in textured for texture in textures):
        for texture in (texture for textures in textured for texture in textures):
            if texture is None or texture.get("type") != "bitmap":
                kind = "plain colour" if texture is None else texture.get("type")
                message = f"its colour can only be a factor on bitmaps, not on a '{kind}'"
                raise objects.source.error(bsdf, f"{message}; give it a bitmap or an <rgb>")
        for inner, elements in zip(inners, given, strict=True):
            for element in elements:
                _make_floating(_own(objects, inner, element))
        return Tint(ids, low, high)
    for inner, elements in zip(inners, given, strict=True):
        if [element.tag for element in elements] != ["rgb"]:
            for element in elements:
                inner.remove(element)
            name = _COLOURS[inner.attrib["type"]]
            value = ", ".join(str((a + b) / 2) for a, b in zip(low, high, strict=True))
            SubElement(inner, "rgb", {"name": name, "value": value})
    dielectric = any("dielectric" in inner.attrib["type"] for inner in inners)
    return (SpecularReflectance if dielectric else Albedo)(ids, low, high)


def _roughness(bsdf: Element, inner: Element, tags: Tags) -> Variable:
    """Alpha, at least the smallest that is rough at all."""
    (low,), (high,) = tags.ends(slice(3, 4))
    low, high = (max(alpha, Roughness.limits[0]) for alpha in (low, high))
    high = nextafter(low, inf) if high == low else high  # it takes a component all the same
    name = _ROUGHNESS[inner.attrib["type"]]
    names = (name, f"{name}_u", f"{name}_v")
    given = [child for child in inner if child.get("name") in names]
    if [(child.tag, child.get("name")) for child in given] != [("float", name)]:
        for child in given:
            inner.remove(child)
        SubElement(inner, "float", {"name": name, "value": str((low + high) / 2)})
    return Roughness((bsdf.attrib["id"],), (low,), (high,))


def _choice(objects: Objects, bsdf: Element) -> Material:
    """Makes one BSDF per texture, between which the shapes choose."""
    parents = {child: parent for parent in objects.root.iter() for child in parent}
    outer = bsdf
    while parents[outer].tag == "bsdf":
        outer = parents[outer]
    name = objects.id_of(outer, like=f"{bsdf.attrib['id']}_side")
    textures = _reflectances(_inner(bsdf))
    if len(textures) < 2:
        objects.source.warn(
            bsdf, "it has no textures to choose from; a component of v changes nothing"
        )
    copies = [objects.copy(outer) for _ in textures[1:]]
    for index, one in enumerate([outer, *copies]):
        inners = (_inner(element) for element in one.iter("bsdf"))
        inner = next((i for i in inners if _reflectances(i)), one)
        for other, texture in enumerate(_reflectances(inner)):
            if other != index:
                inner.remove(texture)
    objects.root[0:0] = copies
    shapes = [
        objects.id_of(shape, like="shape")
        for shape in objects.root.iter("shape")
        if any(ref.get("id") == name for ref in shape.findall("ref"))
    ]
    if not shapes:
        raise objects.source.error(bsdf, "no shape has a <ref> to it; give one to a shape")
    return Material(tuple(shapes), objects.ids(name))


def _inner(bsdf: Element) -> Element:
    """The BSDF in its wrappers, such as 'twosided'."""
    nested = bsdf.find("bsdf")
    return bsdf if nested is None else _inner(nested)


def _reflectances(bsdf: Element) -> list[Element]:
    name = _COLOURS.get(bsdf.get("type", ""))
    return [child for child in bsdf if child.get("name") == name]


def _own(objects: Objects, inner: Element, element: Element) -> Element:
    """The texture of a BSDF; one that it only refers to is copied, since others keep theirs."""
    if element.tag != "ref":
        return element
    own = objects.copy(objects.by_id(element.get("id", "")))
    own.set("name", element.get("name", ""))
    inner[list(inner).index(element)] = own
    return own


def _make_floating(bitmap: Element) -> None:
    """Has Mitsuba keep linear floating-point numbers, whatever the file holds."""
    for child in bitmap.findall("string[@name='format']"):
        bitmap.remove(child)
    SubElement(bitmap, "string", {"name": "format", "value": "variant"})


def _texture(objects: Objects, element: Element) -> Element | None:
    if element.tag == "ref":
        return objects.by_id(element.get("id", ""))
    return element if element.tag == "texture" else None


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
