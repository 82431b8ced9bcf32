"""Every key of every kind of variable: what is wrong with it is said with file, key and value."""

import shutil
from pathlib import Path

import pytest

from ngi.scene import KINDS, read_scene
from tests.render.box import BOX

RIGHT = {
    "albedo": "minimum: [0, 0, 0], maximum: [1, 1, 1]",
    "roughness": "minimum: 0.1, maximum: 0.5",
    "texture": "choices: [scene.xml, scene.yaml]",
    "texels": "size: [2, 3], minimum: 0, maximum: 1",
    "material": "choices: [white, metal]",
    "intensity": "minimum: 0, maximum: 2",
    "radiance": "minimum: [0, 0, 0], maximum: [9, 9, 9]",
    "translation": "minimum: [0, 0, 0], maximum: [1, 0, 1]",
    "rotation": "axis: [0, 1, 0], minimum: 0, maximum: 90",
    "scale": "minimum: 0.5, maximum: 2",
    "visibility": "",
    "shape": "choices: [ball, figure]",
    "key_frames": "files: [scene.xml, scene.yaml]",
    "look_at": "minimum: [0, 1, 2, 0, 0, 0], maximum: [1, 1, 3, 1, 0, 0]",
    "camera_path": "keys: [[0, 1, 2, 0, 0, 0], [1, 1, 3, 1, 0, 0]]",
    "direction": "minimum: [0, 10], maximum: [360, 80]",
    "fov": "minimum: 20, maximum: 60",
    "cone": "minimum: [20, 5], maximum: [40, 15]",
    "eta": "minimum: 1.2, maximum: 1.8",
    **dict.fromkeys(("alpha_u", "alpha_v"), "minimum: 0.1, maximum: 0.5"),
    **dict.fromkeys(("color0", "color1"), "minimum: [0, 0, 0], maximum: [1, 1, 1]"),
    **dict.fromkeys(
        (
            *("metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint"),
            *("clearcoat", "clearcoat_gloss", "flatness", "spec_trans"),
        ),
        "minimum: 0.2, maximum: 0.7",
    ),
}
OPTIONS = {
    "rotation": "pivot: [1, 2, 3]",
    "scale": "pivot: [1, 2, 3]",
    "look_at": "up: [0, 0, 1]",
    "camera_path": "up: [0, 0, 1]",
    "albedo": "linked: true",
    "radiance": "linked: false",
}


def folder_with(tmp_path, *entries):
    folder = Path(shutil.copytree(BOX, tmp_path / "box"))
    lines = [
        "name: box",
        "scene: scene.xml",
        "samples_per_pixel: 8",
        "max_depth: 4",
        "bounds: {minimum: [-1, 0, -1], maximum: [1, 2, 1]}",
        "variables:",
        *(f"  - {{{entry}}}" for entry in entries),
    ]
    (folder / "scene.yaml").write_text("\n".join(lines) + "\n")
    return folder


def entry(kind, keys, name="a"):
    return ", ".join(filter(None, (f"object: {name}, property: {kind}", keys)))


def test_entries_of_every_kind_are_here() -> None:
    assert set(RIGHT) == set(KINDS)


@pytest.mark.parametrize("kind", RIGHT)
def test_right_entries_are_read(tmp_path, kind) -> None:
    keys = ", ".join(filter(None, (RIGHT[kind], OPTIONS.get(kind))))
    (variable,) = read_scene(folder_with(tmp_path, entry(kind, keys))).variables
    assert type(variable) is KINDS[kind]
    assert variable.objects == ("a",)


def test_a_key_that_is_nearly_the_missing_one_is_named(tmp_path) -> None:
    message = r"variables\[0\].keys is missing; add it, or is 'key' meant to be it\?"
    with pytest.raises(ValueError, match=message):
        read_scene(folder_with(tmp_path, entry("camera_path", "key: [[0,0,0, 1,1,1]]")))


@pytest.mark.parametrize("kind", RIGHT)
def test_unknown_keys_and_wrong_objects(tmp_path, kind) -> None:
    for i, (text, message) in enumerate(
        (
            (f"{RIGHT[kind]}, minimun: 3".lstrip(", "), r"unknown key 'variables\[0\].minimun'"),
            (f"{RIGHT[kind]}, axes: x".lstrip(", "), r"unknown key 'variables\[0\].axes'"),
        )
    ):
        with pytest.raises(ValueError, match=message):
            read_scene(folder_with(tmp_path / str(i), entry(kind, text)))
    for i, (name, message) in enumerate(
        (
            ("3", "object is 3; expected a name or a list of names"),
            ("[]", r"object is \[\]; expected at least 1 different name"),
            ("[b, b]", r"object is \['b', 'b'\]; expected at least 1 different name"),
            ("''", "object is ''; expected a name"),
            ("yes", "object is True; expected a name"),
        )
    ):
        with pytest.raises(ValueError, match=rf"scene.yaml: variables\[0\].{message}"):
            read_scene(folder_with(tmp_path / f"{i}_name", entry(kind, RIGHT[kind], name)))


@pytest.mark.parametrize(
    ("kind", "key"),
    [
        (kind, part.split(":")[0].strip())
        for kind, keys in RIGHT.items()
        for part in keys.split(", ")
        if ":" in part
    ],
)
def test_missing_keys(tmp_path, kind, key) -> None:
    keys = RIGHT[kind].replace(f"{key}:", f"not_{key}:")
    with pytest.raises(ValueError, match=rf"scene.yaml: variables\[0\].{key} is missing; add it"):
        read_scene(folder_with(tmp_path, entry(kind, keys)))


WRONG = [
    ("albedo", "minimum: [0, 0], maximum: [1, 1, 1]", r"minimum is \[0, 0\]; expected 3 finite"),
    ("albedo", "minimum: 0, maximum: [1, 1, 1]", "minimum is 0; expected 3 finite"),
    ("albedo", "minimum: [0, 0, 0], maximum: [1, 1, 1.1]", r"maximum is .*between 0.0 and 1.0"),
    ("albedo", "minimum: [-1, 0, 0], maximum: [1, 1, 1]", r"minimum is \[-1.0, 0.0, 0.0\]; albedo"),
    ("albedo", "minimum: [0, 0, 1], maximum: [1, 1, 0]", r"maximum is \[1.0, 1.0, 0.0\]; each"),
    ("albedo", "minimum: [0, 0, 0], maximum: [1, 1, 1], linked: 1", "linked is 1; expected true"),
    ("albedo", "minimum: [1, 1, 1], maximum: [1, 1, 1]", "maximum is .*nothing varies"),
    (
        "albedo",
        "minimum: [1, 1, 1], maximum: [1, 1, 1], linked: true",
        "maximum is .*nothing varies",
    ),
    ("roughness", "minimum: 0, maximum: 0.5", "minimum is .*roughness lies between 0.001 and 1.0"),
    ("roughness", "minimum: 0.1, maximum: 1.5", r"maximum is \[1.5\]; roughness"),
    ("roughness", "minimum: 0.1, maximum: .inf", "maximum is inf; expected 1 finite"),
    ("roughness", "minimum: 0.1, maximum: true", "maximum is True; expected 1 finite"),
    ("roughness", "minimum: 0.1, maximum: 1e-1", "is '1e-1'; .*YAML reads 1e5 as text"),
    ("roughness", "minimum: 0.1, maximum: inf", r"is 'inf'; expected 1 finite number\(s\)$"),
    ("roughness", "minimum: 0.1, maximum: 0.5, linked: true", "unknown key .*linked"),
    ("intensity", "minimum: -1, maximum: 2", r"minimum is \[-1.0\]; intensity"),
    (
        "intensity",
        f"minimum: 0, maximum: 1{'0' * 400}",
        "maximum is 10*[.]{3}0*; expected 1 finite",
    ),
    ("radiance", "minimum: [0, 0, -2], maximum: [9, 9, 9]", "minimum is .*radiance lies between"),
    ("texture", "choices: [scene.xml]", r"choices is \['scene.xml'\]; expected at least 2"),
    ("texture", "choices: scene.xml", "choices is 'scene.xml'; expected at least 2"),
    ("texels", "size: [2], minimum: 0, maximum: 1", r"size is \[2\]; expected 2"),
    ("texels", "size: [2, 1.5], minimum: 0, maximum: 1", r"size is \[2.0, 1.5\]; expected two pos"),
    ("texels", "size: [2, 0], minimum: 0, maximum: 1", r"size is \[2.0, 0.0\]; expected two pos"),
    ("texels", "size: [2, 2], minimum: 0, maximum: 2", "maximum is 2.0; texels lie between 0"),
    ("texels", "size: [2, 2], minimum: -1, maximum: 1", "minimum is -1.0; texels lie between 0"),
    ("texels", "size: [2, 2], minimum: 1, maximum: 1", r"maximum is \[1.0\]; each must be above"),
    ("material", "choices: [white, 3]", r"choices is \['white', 3\]; expected a name"),
    ("material", "choices: [white, white]", r"choices is .*at least 2 different"),
    ("shape", "choices: []", r"choices is \[\]; expected at least 2"),
    ("rotation", "axis: [0, 0, 0], minimum: 0, maximum: 9", r"axis is \[0.0, 0.0, 0.0\]; give a"),
    ("rotation", "axis: y, minimum: 0, maximum: 9", "axis is 'y'; expected 3 finite"),
    ("rotation", "axis: [0, 1, 0], pivot: 0, minimum: 0, maximum: 9", "pivot is 0; expected 3"),
    ("scale", "minimum: 0, maximum: 1", r"minimum is \[0.0\]; scale lies between 1e-06"),
    ("key_frames", "files: [scene.xml]", r"files is \['scene.xml'\]; expected at least 2"),
    ("look_at", "minimum: [0, 0, 0], maximum: [1, 1, 1]", r"minimum is \[0, 0, 0\]; expected 6"),
    ("look_at", f"{RIGHT['look_at']}, up: [0, 0, 0]", r"up is \[0.0, 0.0, 0.0\]; give a"),
    ("look_at", f"{RIGHT['look_at']}, up: y", "up is 'y'; expected 3"),
    ("camera_path", "keys: []", r"keys is \[\]; give at least one"),
    ("camera_path", "keys: [[0, 1, 2, 0, 0, 0]]", "keys is 1; give at least two views"),
    ("camera_path", "keys: [[0, 1, 2, 0, 0, 0], 3]", r"keys\[1\] is 3; expected 6 finite"),
    ("camera_path", f"{RIGHT['camera_path']}, up: [0, 0, 0]", "up is .*give a direction"),
    ("direction", "minimum: [0, -400], maximum: [1, 1]", "minimum is .*direction lies between"),
    ("fov", "minimum: 0, maximum: 60", r"minimum is \[0.0\]; fov lies between 0.1 and 179"),
    ("fov", "minimum: 20, maximum: 180", r"maximum is \[180.0\]; fov lies between"),
    ("cone", "minimum: 20, maximum: 40", "minimum is 20; expected 2 finite"),
    (
        "cone",
        "minimum: [20, 5], maximum: [40, 30]",
        "beam_width reaches 30, cutoff_angle goes",
    ),
    ("cone", "minimum: [20, -5], maximum: [40, 15]", "minimum is .*cone lies between 0.0 and 180"),
    ("eta", "minimum: 0, maximum: 1.5", r"minimum is \[0.0\]; eta lies between 0.2 and 5"),
    ("metallic", "minimum: 0, maximum: 1.5", r"maximum is \[1.5\]; metallic lies between 0.0 and"),
    ("color0", "minimum: 0, maximum: 1", "minimum is 0; expected 3 finite"),
]


@pytest.mark.parametrize(("kind", "keys", "message"), WRONG)
def test_wrong_values(tmp_path, kind, keys, message) -> None:
    with pytest.raises(ValueError, match=message) as error:
        read_scene(folder_with(tmp_path, entry(kind, keys)))
    assert "scene.yaml: " in str(error.value)
    assert "variables[0]." in str(error.value)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("rotation", r"pivot is None; give the point about which \['a', 'b'\] turn together"),
        ("scale", r"pivot is None; give the point"),
        ("key_frames", r"object is \['a', 'b'\]; key frames belong to one mesh"),
        ("camera_path", r"object is \['a', 'b'\]; a path belongs to one camera"),
    ],
)
def test_several_objects(tmp_path, kind, message) -> None:
    with pytest.raises(ValueError, match=rf"scene.yaml: variables\[0\].{message}"):
        read_scene(folder_with(tmp_path, entry(kind, RIGHT[kind], "[a, b]")))


@pytest.mark.parametrize(
    ("first", "second", "problem"),
    [
        (("translation", "a"), ("translation", "[b, a]"), "a.translation"),
        (("visibility", "[a, b]"), ("visibility", "[b, a]"), "a.visibility"),
        (("look_at", "a"), ("camera_path", "a"), "a.look_at"),
        (("texture", "a"), ("texels", "a"), "a.texture"),
    ],
)
def test_two_variables_of_one_thing(tmp_path, first, second, problem) -> None:
    entries = [entry(kind, RIGHT[kind], name) for kind, name in (first, second)]
    with pytest.raises(ValueError, match=f"variables is '{problem}'; it is there twice"):
        read_scene(folder_with(tmp_path, *entries))


def test_two_rotations_of_one_object(tmp_path) -> None:
    folder = folder_with(tmp_path, *[entry("rotation", RIGHT["rotation"])] * 2)
    assert read_scene(folder).component_names == ("a.rotation", "a.rotation_2")


def test_no_variables(tmp_path) -> None:
    folder = folder_with(tmp_path)
    text = (folder / "scene.yaml").read_text()
    (folder / "scene.yaml").write_text(text.replace("variables:", "variables: []"))
    with pytest.raises(ValueError, match=r"scene.yaml: variables is \[\]; name at least one"):
        read_scene(folder)


@pytest.mark.parametrize("kind", ["texture", "key_frames"])
def test_files_that_are_not_there(tmp_path, kind) -> None:
    keys = RIGHT[kind].replace("scene.yaml", "b.png")
    with pytest.raises(FileNotFoundError, match=r"scene.yaml: variables names 'b.png', which"):
        read_scene(folder_with(tmp_path, entry(kind, keys)))


@pytest.mark.parametrize("kind", ["texture", "key_frames"])
def test_hash_follows_files_of_variables(tmp_path, kind) -> None:
    folder = folder_with(tmp_path, entry(kind, RIGHT[kind].replace("scene.yaml", "b.png")))
    (folder / "b.png").write_bytes(b"1")
    first = read_scene(folder).scene_hash
    (folder / "b.png").write_bytes(b"2")
    assert read_scene(folder).scene_hash != first
