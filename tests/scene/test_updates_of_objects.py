"""Objects that move, vanish and deform, against scenes written with them there."""

import numpy as np
import pytest

from tests.scene.stage import about, curtain, find, moved, rotate, scale, translate, write_ply
from tests.scene.updates import Update, check_update

BOX = {"minimum": [-0.4, 0, -0.4], "maximum": [0.4, 0.4, 0.4]}


def translation(object_id):
    return {"object": object_id, "property": "translation", **BOX}


def moved_all(object_ids, *operations):
    def edit(root) -> None:
        for object_id in object_ids:
            moved(object_id, *operations)(root)

    return edit


def without(*object_ids):
    def edit(root) -> None:
        for object_id in object_ids:
            root.remove(find(root, object_id))

    return edit


TRANSLATIONS = [
    Update(
        f"translation of {what}",
        variables=[translation(object_id)],
        v=[0.75, 0.5, 0.25],
        off=[0.55, 0.5, 0.25],
        edit=moved(object_id, translate(0.2, 0.2, -0.2)),
    )
    for what, object_id in (
        ("an instance", "wedge"),
        ("a sphere", "ball"),
        ("a rectangle", "board"),
        ("an emitting rectangle", "light"),
        ("a mesh", "curtain"),
        ("an emitting mesh", "globe"),
    )
]

PIVOT = [0.5, 0.1, 0.3]
OTHER_PIVOT = [0.2, 0.3, 0.1]
ROTATION = {"property": "rotation", "axis": [3, 4, 0], "minimum": 0, "maximum": 90}
SCALE = {"property": "scale", "minimum": 0.5, "maximum": 1.5}

TURNS_AND_SIZES = [
    Update(
        "rotation about a pivot",
        variables=[{"object": "wedge", "pivot": PIVOT, **ROTATION}],
        v=[0.5],
        off=[0.7],
        edit=moved("wedge", *about(PIVOT, rotate([0.6, 0.8, 0], 45))),
    ),
    *(
        Update(
            f"rotation of {what} about its own origin",
            variables=[{"object": object_id, **ROTATION}],
            v=[0.5],
            off=[0.85],
            edit=moved(object_id, *about(origin, rotate([0.6, 0.8, 0], 45))),
        )
        for what, object_id, origin in (
            ("an instance", "wedge", [0.5, 0.3, 0]),
            ("an emitting rectangle", "light", [0, 2.2, 0]),
            ("an emitting mesh", "globe", [-0.6, 0.6, 0.2]),
        )
    ),
    *(
        Update(
            f"scale of {what}",
            variables=[{"object": object_id, **SCALE}],
            v=[0.75],
            off=[0.5],
            edit=moved(object_id, *about(origin, scale(1.25))),
        )
        for what, object_id, origin in (
            ("an instance", "cube", [0.6, 1.1, -0.3]),
            ("a sphere", "ball", [0, 0.4, 0]),
            ("an emitting rectangle", "light", [0, 2.2, 0]),
            ("an emitting mesh", "globe", [-0.6, 0.6, 0.2]),
        )
    ),
    Update(
        "translation * rotation * scale",
        variables=[
            translation("wedge"),
            {"object": "wedge", "pivot": OTHER_PIVOT, **SCALE},
            {"object": "wedge", "pivot": PIVOT, **ROTATION},
        ],
        v=[0.25, 0.5, 0.25, 0.75, 0.5],
        off=[0.25, 0.5, 0.25, 0.4, 0.5],
        edit=moved(
            "wedge",
            *about(OTHER_PIVOT, scale(1.25)),
            *about(PIVOT, rotate([0.6, 0.8, 0], 45)),
            translate(-0.2, 0.2, -0.2),
        ),
    ),
    Update(
        "two rotations, the first one first",
        variables=[
            {"object": "wedge", "property": "rotation", "axis": axis, "minimum": 0, "maximum": 90}
            for axis in ([0, 1, 0], [1, 0, 0])
        ],
        v=[1, 0.5],
        off=[0.5, 1],
        edit=moved(
            "wedge",
            *about([0.5, 0.3, 0], rotate([0, 1, 0], 90)),
            *about([0.5, 0.3, 0], rotate([1, 0, 0], 45)),
        ),
    ),
    Update(
        "objects that move together",
        variables=[
            {**translation("x"), "object": ["ball", "globe", "cube"]},
            {"object": ["ball", "globe"], "pivot": PIVOT, **ROTATION},
        ],
        v=[0.25, 0.5, 0.25, 0.5],
        off=[0.25, 0.5, 0.25, 0.6],
        edit=lambda root: (
            moved_all(["ball", "globe"], *about(PIVOT, rotate([0.6, 0.8, 0], 45)))(root),
            moved_all(["ball", "globe", "cube"], translate(-0.2, 0.2, -0.2))(root),
        ),
    ),
]

PRESENCE = [
    Update(
        "visibility of an instance, a sphere, a rectangle and a mesh",
        variables=[
            {"object": ["wedge", "ball"], "property": "visibility"},
            {"object": ["board", "curtain"], "property": "visibility"},
        ],
        v=[0.7, 0.4],
        off=[0.7, 0.5],
        edit=without("board", "curtain"),
    ),
    Update(
        "the other ones are invisible",
        variables=[
            {"object": ["wedge", "ball"], "property": "visibility"},
            {"object": ["board", "curtain"], "property": "visibility"},
            translation("wedge"),
        ],
        v=[0.49, 0.5, 0.1, 0.5, 0.5],
        off=[0.5, 0.5, 0.5, 0.5, 0.5],
        edit=without("wedge", "ball"),
    ),
    Update(
        "shape",
        variables=[
            {"object": "body", "property": "shape", "choices": ["wedge", "ball", "cube"]},
            translation("cube"),
        ],
        v=[0.67, 0.25, 0.5, 0.75],
        off=[0.66, 0.25, 0.5, 0.75],
        edit=lambda root: (
            without("wedge", "ball")(root),
            moved("cube", translate(-0.2, 0.2, 0.2))(root),
        ),
    ),
]


def with_frames(name, *, face_normals=False):
    """The stage with one of the meshes whose shape varies."""

    def edit(root) -> None:
        owner = find(root, "curtain")
        owner.find("string").set("value", f"{name}_0.ply")
        if face_normals:
            owner.append(owner.makeelement("boolean", {"name": "face_normals", "value": "true"}))

    return edit


def between(name, weight, folder) -> None:
    """Writes the mesh between the second and the third key frame."""
    (p, triangles, n), (q, _, m) = curtain(0.6), curtain(0.2)
    normals = (1 - weight) * n + weight * m
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    write_ply(
        folder / f"{name}_0.ply",
        (1 - weight) * p + weight * q,
        triangles,
        normals if name == "curtain" else None,
    )


SHAPES = [
    Update(
        f"key frames of {what}{' that moves too' if more else ''}",
        variables=[
            {
                "object": "curtain",
                "property": "key_frames",
                "files": [f"{name}_{i}.ply" for i in range(3)],
            },
            *([translation("curtain"), {"object": "curtain", **ROTATION}] if more else []),
        ],
        v=[0.75, 0.75, 0.5, 0.25, 0.5] if more else [0.75],
        off=[0.5, 0.5, 0.5, 0.25, 0.5] if more else [0.5],
        before=with_frames(name, face_normals=face_normals),
        files=lambda folder, name=name: between(name, 0.5, folder),
        edit=moved(
            "curtain",
            *about([0.1, 1, -0.5], rotate([0.6, 0.8, 0], 45)),
            translate(0.2, 0.2, -0.2),
        )
        if more
        else None,
    )
    for what, name, face_normals in (
        ("a mesh with vertex normals", "curtain", False),
        ("a mesh without vertex normals", "sheet", True),
        ("a mesh whose normals Mitsuba makes", "sheet", False),
    )
    for more in (False, True)
]


UPDATES = [*TRANSLATIONS, *TURNS_AND_SIZES, *PRESENCE, *SHAPES]


@pytest.mark.parametrize("update", UPDATES, ids=lambda update: update.name)
def test_update_equals_a_scene_written_with_the_value(update, make_scene) -> None:
    check_update(update, "scalar", make_scene)
