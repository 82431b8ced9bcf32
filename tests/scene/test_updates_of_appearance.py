"""Materials and textures that vary, against scenes written with their values."""

from xml.etree import ElementTree

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate
from ngi.render.exr import write_exr
from tests.scene.stage import find, set_value
from tests.scene.updates import Update, check_update

COLOURS = {"minimum": [0, 0.2, 0.1], "maximum": [1, 0.2, 0.9]}
COLOUR = "0.75, 0.2, 0.3"
"""At [0.75, 0.25]."""

SIZE = (4, 6)
"""Rows and columns of the picture."""

TEXELS = (np.arange(24) * 7 % 24 / 23).tolist()


def with_values(*values):
    def edit(root) -> None:
        for object_id, name, value in values:
            set_value(root, object_id, name, value)

    return edit


def with_bsdfs(**bsdfs):
    """Gives shapes other materials."""

    def edit(root) -> None:
        for shape_id, bsdf_id in bsdfs.items():
            find(root, shape_id).find("ref").set("id", bsdf_id)

    return edit


def albedo(*bsdfs):
    return {"object": list(bsdfs), "property": "albedo", **COLOURS}


MATERIALS = [
    Update(
        "albedo of several kinds of BSDF",
        variables=[albedo("paint", "clay", "metal", "principled")],
        v=[0.75, 0.25],
        off=[0.75, 0.5],
        edit=with_values(
            ("paint", "reflectance", COLOUR),
            ("clay", "diffuse_reflectance", COLOUR),
            ("metal", "specular_reflectance", COLOUR),
            ("principled", "base_color", COLOUR),
        ),
    ),
    *(
        Update(
            f"roughness of {bsdf_id}",
            variables=[
                {"object": bsdf_id, "property": "roughness", "minimum": 0.1, "maximum": 0.9}
            ],
            v=[0.125],
            off=[0.625],
            before=with_bsdfs(floor=bsdf_id, left=bsdf_id),
            edit=with_values((bsdf_id, name, "0.2")),
        )
        for bsdf_id, name in (("metal", "alpha"), ("clay", "alpha"), ("principled", "roughness"))
    ),
    Update(
        "material of a sphere, a rectangle, an instance and a group",
        variables=[
            {
                "object": ["ball", "back", "cube"],
                "property": "material",
                "choices": ["paint", "lacquer", "metal"],
            },
            {"object": "wedge_group", "property": "material", "choices": ["blue", "white"]},
        ],
        v=[0.6, 0.4],
        off=[0.6, 0.6],
        edit=lambda root: (
            with_bsdfs(ball="lacquer", back="lacquer", wedge_mesh="blue")(root),
            set_bsdf_of_cube(root, "lacquer"),
        ),
    ),
    Update(
        "variables of a BSDF that is only a choice",
        variables=[
            {"object": "back", "property": "material", "choices": ["white", "lacquer"]},
            albedo("lacquer"),
            {"object": "lacquer", "property": "roughness", "minimum": 0.1, "maximum": 0.9},
        ],
        v=[0.6, 0.75, 0.25, 0.125],
        off=[0.6, 0.75, 0.5, 0.125],
        edit=lambda root: (
            with_bsdfs(back="lacquer")(root),
            with_values(("lacquer", "diffuse_reflectance", COLOUR), ("lacquer", "alpha", "0.2"))(
                root
            ),
        ),
    ),
    Update(
        "material of an instance that moves",
        variables=[
            {"object": ["wedge", "curtain"], "property": "material", "choices": ["white", "blue"]},
            {
                "object": ["wedge", "curtain"],
                "property": "translation",
                "minimum": [-1, 0, 0],
                "maximum": [1, 0, 0],
            },
        ],
        v=[0.6, 0.5],
        off=[0.4, 0.5],
        edit=with_bsdfs(wedge_mesh="blue", curtain="blue"),
    ),
]


def set_bsdf_of_cube(root, bsdf_id) -> None:
    find(root, "cube_group").find("shape/ref").set("id", bsdf_id)


def stored_as(**options):
    """The stage whose picture is kept in another way."""

    def edit(root) -> None:
        texture = find(root, "picture").find(".//texture")
        for name, value in options.items():
            kind = "boolean" if name == "raw" else "string"
            ElementTree.SubElement(texture, kind, name=name, value=value)

    return edit


WAYS = {
    "8 bits": {},
    "raw 8 bits": {"raw": "true"},
    "floating point": {"format": "variant"},
    "raw half precision": {"format": "fp16", "raw": "true"},
}


def write_texels(folder) -> None:
    activate("scalar")
    linear = (0.1 + 0.8 * np.array(TEXELS)).reshape(*SIZE, 1).repeat(3, axis=2)
    write_exr(folder / "linear.exr", torch.from_numpy(linear))


TEXTURES = [
    *(
        Update(
            f"texture in {way}",
            variables=[
                {
                    "object": "picture",
                    "property": "texture",
                    "choices": ["dots.png", "stripes.png"],
                }
            ],
            v=[0.5],
            off=[0.49],
            before=stored_as(**options),
            edit=with_values(("picture", "filename", "stripes.png")),
        )
        for way, options in WAYS.items()
    ),
    *(
        Update(
            f"texels in {way}",
            variables=[
                {
                    "object": "picture",
                    "property": "texels",
                    "size": list(SIZE),
                    "minimum": 0.1,
                    "maximum": 0.9,
                }
            ],
            v=TEXELS,
            off=[0.6 if i == 21 else u for i, u in enumerate(TEXELS)],
            before=stored_as(**options),
            edit=with_values(("picture", "filename", "linear.exr")),
            files=write_texels,
        )
        for way, options in WAYS.items()
    ),
]


UPDATES = [*MATERIALS, *TEXTURES]


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_update_equals_a_scene_written_with_the_value(update, make_scene) -> None:
    check_update(update, "scalar", make_scene)
