"""Writes elements of Mitsuba's XML as text."""

from __future__ import annotations

from collections.abc import Sequence

INDENT = "    "


def indented(lines: Sequence[str]) -> list[str]:
    return [INDENT + line for line in lines]


def element(tag: str, kind: str, name: str | None, *children: list[str] | str) -> list[str]:
    """Lines of <tag type=kind id=name> around its children (lines, or one line each)."""
    inner = [c for child in children for c in ([child] if isinstance(child, str) else child)]
    identity = f' id="{name}"' if name else ""
    return [f'<{tag} type="{kind}"{identity}>', *indented(inner), f"</{tag}>"]


def rgb(name: str, *values: float) -> str:
    return f'<rgb name="{name}" value="{", ".join(f"{v:g}" for v in values)}"/>'


def image(name: str, file: str, *, mirrored: bool = False, repeat: float = 1) -> list[str]:
    children: list[list[str] | str] = [f'<string name="filename" value="{file}"/>']
    if mirrored:
        children.append('<string name="wrap_mode" value="mirror"/>')
    if repeat != 1:
        children.append(transform(f'<scale value="{repeat:g}"/>', name="to_uv"))
    lines = element("texture", "bitmap", None, *children)
    return [lines[0].replace(">", f' name="{name}">'), *lines[1:]]


def transform(*steps: str, name: str = "to_world") -> list[str]:
    return [f'<transform name="{name}">', *indented(steps), "</transform>"]


def diffuse(name: str, *colour: float, both_sides: bool = False) -> list[str]:
    if both_sides:
        return element("bsdf", "twosided", name, diffuse("", *colour))
    return element("bsdf", "diffuse", name, rgb("reflectance", *colour))


def glossy(
    name: str, alpha: float, base: str | list[str], *, both_sides: bool = False
) -> list[str]:
    """A rough plastic; base is its diffuse reflectance."""
    if both_sides:
        return element("bsdf", "twosided", name, glossy("", alpha, base))
    kind = '<string name="distribution" value="ggx"/>'
    return element(
        "bsdf", "roughplastic", name, kind, f'<float name="alpha" value="{alpha:g}"/>', base
    )


def metal(name: str, alpha: float, material: str) -> list[str]:
    return element(
        "bsdf", "roughconductor", name,
        f'<string name="material" value="{material}"/>',
        '<string name="distribution" value="ggx"/>',
        f'<float name="alpha" value="{alpha:g}"/>',
    )  # fmt: skip


def mesh(file: str, material: str) -> list[str]:
    name = f'<string name="filename" value="{file}"/>'
    return element("shape", "ply", file.removesuffix(".ply"), name, f'<ref id="{material}"/>')


def group(name: str, files: list[tuple[str, str]]) -> list[str]:
    """A shapegroup of (file, material id)."""
    return element("shape", "shapegroup", f"{name}_meshes", *(mesh(*file) for file in files))


def instance(name: str, x: float, z: float, turn: float) -> list[str]:
    """Of the group with the same name, turned about y and put on the floor."""
    steps = [f'<rotate y="1" angle="{turn:g}"/>'] if turn else []
    steps += [f'<translate x="{x:g}" z="{z:g}"/>'] if x or z else []
    place = transform(*steps) if steps else []
    return element("shape", "instance", name, f'<ref id="{name}_meshes"/>', place)


def rectangle(
    name: str, material: str, half: tuple[float, float], turns: Sequence[str], at: Sequence[float]
) -> list[str]:
    """Of half sizes x and y, turned and moved to its centre."""
    move = f'<translate x="{at[0]:g}" y="{at[1]:g}" z="{at[2]:g}"/>'
    place = transform(f'<scale x="{half[0]:g}" y="{half[1]:g}"/>', *turns, move)
    return element("shape", "rectangle", name, place, f'<ref id="{material}"/>')


def globe(
    name: str, centre: Sequence[float], radius: float, radiance: Sequence[float]
) -> list[str]:
    point = f'<point name="center" x="{centre[0]:g}" y="{centre[1]:g}" z="{centre[2]:g}"/>'
    size = f'<float name="radius" value="{radius:g}"/>'
    light = area_light(*radiance)
    return element("shape", "sphere", name, point, size, '<ref id="lamp_glass"/>', light)


def area_light(*radiance: float) -> list[str]:
    return element("emitter", "area", None, rgb("radiance", *radiance))
