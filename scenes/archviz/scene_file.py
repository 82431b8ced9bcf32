"""scene.xml of the living room: materials, shapes, lights, in Mitsuba's XML."""

from __future__ import annotations

import scene_text as text
from rooms import FRAMED, HALF_X, HALF_Z, HEIGHT, MOVERS

HEAD = """<?xml version="1.0" encoding="utf-8"?>
<!--
  ArchViz: variations of a living room with a dining area, after the data set of Compositional
  Neural Scene Representations (Granskog et al. 2020). Stock Mitsuba 3; what varies, and how far,
  is in scene.yaml; until a choice is made, all chairs and vases to choose from show at once, in
  one place. Written by make.py. Lengths in metres: x in [-4.2, 4.2], y (up) in [0, 2.75],
  z in [-3.2, 3.2]; sun and sky come through the window wall x = -4.2.
-->
<scene version="3.0.0">
    <integrator type="path">
        <integer name="max_depth" value="8"/>
    </integrator>

    <sensor type="perspective" id="camera">
        <float name="fov" value="70"/>
        <string name="fov_axis" value="x"/>
        <float name="near_clip" value="0.01"/>
        <float name="far_clip" value="100"/>
        <transform name="to_world">
            <lookat origin="0.3, 1.5, 2.9" target="0.1, 0.85, -1.4" up="0, 1, 0"/>
        </transform>
        <sampler type="independent">
            <integer name="sample_count" value="400"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="600"/>
            <integer name="height" value="600"/>
            <rfilter type="box"/>
        </film>
    </sensor>
"""

REFLECTANCE, BASE = "reflectance", "diffuse_reflectance"

MATERIALS = [
    text.diffuse("wall_paint", 0.74, 0.71, 0.66),
    text.diffuse("sofa_fabric", 0.36, 0.4, 0.36),
    text.diffuse("curtain_fabric", 0.7, 0.66, 0.58, both_sides=True),
    text.diffuse("white_paint", 0.82, 0.81, 0.78),
    text.diffuse("armchair_fabric", 0.52, 0.26, 0.14),
    text.diffuse("chair_fabric", 0.16, 0.24, 0.3),
    text.diffuse("cushion", 0.62, 0.42, 0.2),
    text.diffuse("paper", 0.78, 0.74, 0.64),
    text.diffuse("book_0", 0.46, 0.14, 0.1),
    text.diffuse("book_1", 0.12, 0.2, 0.3),
    text.diffuse("book_2", 0.68, 0.62, 0.5),
    text.diffuse("soil", 0.06, 0.045, 0.035),
    text.diffuse("pot", 0.62, 0.6, 0.57),
    text.diffuse("lamp_glass", 0.6, 0.6, 0.6),
    text.glossy("floor_boards", 0.15, text.image(BASE, "planks.jpg", repeat=3)),
    text.glossy("oak", 0.2, text.image(BASE, "oak.jpg", mirrored=True)),
    text.glossy("wood", 0.25, text.image(BASE, "walnut.jpg", mirrored=True)),
    text.glossy("marble", 0.12, text.image(BASE, "marble.jpg", mirrored=True)),
    text.glossy("ebony", 0.12, text.rgb(BASE, 0.035, 0.03, 0.028)),
    text.glossy("lacquer", 0.3, text.rgb(BASE, 0.2, 0.25, 0.24)),
    text.glossy("black", 0.3, text.rgb(BASE, 0.03, 0.03, 0.032)),
    text.glossy("shell", 0.3, text.rgb(BASE, 0.66, 0.63, 0.58), both_sides=True),
    text.glossy("leaf", 0.3, text.rgb(BASE, 0.07, 0.19, 0.06), both_sides=True),
    text.glossy("ceramic", 0.15, text.rgb(BASE, 0.12, 0.28, 0.34)),
    text.glossy("porcelain", 0.15, text.rgb(BASE, 0.76, 0.74, 0.7)),
    text.glossy("fruit", 0.25, text.rgb(BASE, 0.72, 0.3, 0.04)),
    text.metal("brass", 0.25, "Au"),
    text.metal("metal", 0.2, "Cr"),
]


def picture_material(name: str, file: str) -> list[str]:
    return text.element("bsdf", "diffuse", name, text.image(REFLECTANCE, file))


def flat_shapes() -> list[list[str]]:
    """Floor, ceiling, three walls (a little larger than the room), rug and pictures."""
    x, z, y = HALF_X + 0.05, HALF_Z + 0.05, HEIGHT / 2
    up, down = '<rotate x="1" angle="-90"/>', '<rotate x="1" angle="90"/>'
    around, left = '<rotate y="1" angle="180"/>', '<rotate y="1" angle="-90"/>'
    shapes = [
        text.rectangle("floor", "floor_boards", (x, z), [up], (0, 0, 0)),
        text.rectangle("ceiling", "white_paint", (x, z), [down], (0, HEIGHT, 0)),
        text.rectangle("back_wall", "wall_paint", (x, y + 0.05), [], (0, y, -HALF_Z)),
        text.rectangle("front_wall", "wall_paint", (x, y + 0.05), [around], (0, y, HALF_Z)),
        text.rectangle("right_wall", "wall_paint", (z, y + 0.05), [left], (HALF_X, y, 0)),
        text.rectangle("rug", "rug_wool", (1.45, 1.0), [up], (-1.7, 0.003, -0.7)),
    ]
    for name, (px, py, w, h) in FRAMED.items():
        place = (px, py, -HALF_Z + 0.01)
        shapes.append(text.rectangle(name, f"{name}_print", (w, h), [], place))
    return shapes


def lights() -> list[list[str]]:
    lamp = MOVERS["floor_lamp"]
    sky = [
        '<string name="filename" value="garden.jpg"/>',
        '<float name="scale" value="5"/>',
    ]
    sun = [
        '<vector name="direction" x="0.7" y="-0.6" z="-0.25"/>',
        text.rgb("irradiance", 14, 12, 9.2),
    ]
    panel = text.rectangle(
        "ceiling_panel",
        "lamp_glass",
        (1.1, 0.3),
        ['<rotate x="1" angle="90"/>'],
        (0, HEIGHT - 0.005, 0.8),
    )
    panel[-1:] = [*text.indented(text.area_light(9, 8.7, 8.2)), panel[-1]]
    return [
        panel,
        text.element("emitter", "envmap", "sky", *sky),
        text.element("emitter", "directional", "sun", *sun),
        text.globe("floor_lamp_globe", (lamp.x, 1.575, lamp.z), 0.17, (19, 15, 10)),
        text.globe("pendant_left", (2.05, 1.71, -0.55), 0.16, (13, 11, 8)),
        text.globe("pendant_right", (2.65, 1.71, -0.55), 0.16, (13, 11, 8)),
    ]


def scene_xml(files: dict[str, list[tuple[str, str]]]) -> str:
    """files: (file name, material id) of the meshes of every piece, and of the static `room`."""
    prints = {
        "picture_left": "shapes_0.jpg",
        "picture_middle": "shapes_1.jpg",
        "picture_right": "hills_0.jpg",
    }
    materials = [*MATERIALS, picture_material("rug_wool", "rug_0.jpg")]
    materials += [picture_material(f"{name}_print", file) for name, file in prints.items()]
    shapes = [text.group("room", files["room"]), text.instance("room", 0, 0, 0), *flat_shapes()]
    for mover in MOVERS.values():
        for name in mover.pieces:
            shapes.append(text.group(name, files[name]))
            shapes.append(text.instance(name, mover.x, mover.z, mover.turn))
    blocks = ["\n".join(text.indented(line for block in part for line in block))
              for part in (materials, shapes, lights())]  # fmt: skip
    return HEAD + "\n" + "\n\n".join(blocks) + "\n</scene>\n"
