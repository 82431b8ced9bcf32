"""Reading scene folders: what is right, and one clear error for everything that is wrong."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ngi.scene import read_scene
from ngi.scene.yaml_keys import load_yaml
from tests.render.box import BOX

SCENES = sorted(p.parent for p in (Path(__file__).parents[2] / "scenes").glob("*/scene.yaml"))


@pytest.fixture
def box(tmp_path):
    return Path(shutil.copytree(BOX, tmp_path / "box"))


def edit(folder, old, new, file="scene.yaml"):
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))


def test_box() -> None:
    scene = read_scene(BOX)
    assert scene.name == "box"
    assert (scene.samples_per_pixel, scene.max_depth, scene.dimensions) == (8, 4, 10)
    assert scene.component_names[2:8] == (
        "left_wall.albedo.b",
        "ball.translation.x",
        "ball.translation.y",
        "ball.translation.z",
        "figure.translation.x",
        "figure.translation.z",
    )
    assert scene.component_names[8:] == ("metal.roughness", "lamp.intensity")
    assert scene.bounds == ((-1.0, 0.0, -1.0), (1.0, 2.0, 1.0))


@pytest.mark.parametrize("folder", SCENES, ids=lambda folder: folder.name)
def test_shipped_scenes_are_right(folder) -> None:
    scene = read_scene(folder)
    assert scene.name == folder.name
    assert len(scene.hard_frames) == 10


def test_values_of_the_box() -> None:
    box = read_scene(BOX)
    middle = [[0.5, 0.5, 0.5], [0, 0.2, 0], [0, 0, 0], [0.3], [1.25]]
    for value, expected in zip(box.values(np.full(10, 0.5)), middle, strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-15)
    low, high = box.values(np.zeros(10)), box.values(np.ones(10))
    for variable, a, b in zip(box.variables, low, high, strict=True):
        np.testing.assert_allclose(a, variable.minimum)
        np.testing.assert_allclose(b, variable.maximum)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ([0.5] * 9, r"scene vector of shape \[9\]: box has 10 variables, left_wall.albedo.r, "),
        ([[0.5] * 10], r"scene vector of shape \[1, 10\]"),
        ([0.5] * 9 + [1.01], "component 'lamp.intensity' is 1.01, expected 0 to 1"),
        ([np.nan] + [0.5] * 9, "component 'left_wall.albedo.r' is nan"),
        ([0.5] * 3 + [-1e-9] + [0.5] * 6, "component 'ball.translation.x' is -1e-09"),
    ],
)
def test_bad_scene_vector(bad, message) -> None:
    with pytest.raises(ValueError, match=message):
        read_scene(BOX).values(bad)


def test_hash_follows_contents_not_place(box, tmp_path) -> None:
    moved = shutil.copytree(box, tmp_path / "elsewhere")
    assert read_scene(moved).scene_hash == read_scene(box).scene_hash == read_scene(BOX).scene_hash
    edit(box, 'value="0.2"/>\n        </bsdf>', 'value="0.21"/>\n        </bsdf>', "scene.xml")
    assert read_scene(box).scene_hash != read_scene(moved).scene_hash


def test_hash_follows_named_files(box) -> None:
    edit(
        box,
        '<shape type="rectangle" id="back">',
        '<default name="mesh" value="a.ply"/>\n<shape type="ply"><string name="filename" '
        'value="$mesh"/></shape>\n<shape type="rectangle" id="back">',
        "scene.xml",
    )
    with pytest.raises(FileNotFoundError, match=r"scene.xml, line \d+: <shape> names 'a.ply'"):
        read_scene(box)
    (box / "a.ply").write_bytes(b"1")
    first = read_scene(box).scene_hash
    (box / "a.ply").write_bytes(b"2")
    assert read_scene(box).scene_hash != first


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("name: box", "name: [box", r"scene.yaml, line \d+: broken YAML"),
        ("name: box", "name: box\nname: box", r"line 2: .*the key 'name' is there twice"),
        ("property: albedo,", "property: albedo, property: albedo,", "'property' is there twice"),
        ("name: box", "name: b\x01ox", "scene.yaml: broken YAML: unacceptable character"),
        ("name: box", "nam: box", "name is missing; add it"),
        ("name: box", "name: box\nmax_deth: 3", "unknown key 'max_deth'; did you mean 'max_depth'"),
        ("max_depth: 4", "max_depth: 5", "max_depth is 5, but 4 in the integrator of"),
        ("max_depth: 4", "max_depth: 0", "max_depth is 0; expected a positive integer"),
        (
            "samples_per_pixel: 8",
            "samples_per_pixel: yes",
            "samples_per_pixel is True; expected int",
        ),
        ("scene: scene.xml", "scene: scen.xml", "scene names 'scen.xml', which does not exist"),
        ("maximum: [1, 2, 1]", "maximum: [1, 0, 1]", r"bounds.maximum is \[1.0, 0.0, 1.0\]"),
        ("property: albedo", "property: albdo", "property is 'albdo'; choose one of .*'albedo'"),
        (
            "minimum: 0.1, maximum: 0.5",
            "minimum: 0.5, maximum: 0.1",
            r"variables\[3\].maximum is \[0.1\]",
        ),
        (
            "minimum: 0.1, maximum: 0.5",
            "minimum: 0.5, maximum: 0.5",
            r"variables\[3\].maximum is 0.5; it equals minimum",
        ),
        ("minimum: 0.1, maximum: 0.5", "minimum: 0, maximum: 0.5", "roughness lies between 0.001"),
        (
            "minimum: 0.5, maximum: 2",
            "minimum: [0, 1], maximum: 2",
            r"variables\[4\].minimum is \[0, 1\]; expected 1",
        ),
        (
            "minimum: 0.5, maximum: 2",
            "minimum: 0.5, maximum: .nan",
            r"variables\[4\].maximum is nan",
        ),
        ("object: lamp", "objct: lamp", r"variables\[4\].object is missing"),
        ("object: lamp", "far: 1, object: lamp", r"unknown key 'variables\[4\].far'"),
        (
            "object: lamp, property: intensity, minimum: 0.5, maximum: 2",
            "object: metal, property: roughness, minimum: 0.5, maximum: 0.6",
            "metal.roughness'; it is there twice",
        ),
        ("- [1, 0, 0, 0.2,", "- [2, 0, 0, 0.2,", r"hard_frames\[1\] is \[2.0, .* between 0 and 1"),
        (
            "- [1, 0, 0, 0.2,",
            "- [0, 0, 0.2,",
            r"hard_frames\[1\] is .*expected 10 finite .* views of the camera",
        ),
        ("- [1, 1, 1, 1, 1,", "- [1, 1, 1, 1, -1,", r"camera_path\[1\] is"),
    ],
)
def test_bad_yaml(box, old, new, message) -> None:
    edit(box, old, new)
    with pytest.raises((ValueError, FileNotFoundError), match=message) as error:
        read_scene(box)
    assert str(box) in str(error.value)


def test_yaml_of_another_encoding(box) -> None:
    (box / "scene.yaml").write_bytes("name: böx".encode("latin-1"))
    with pytest.raises(ValueError, match=r"scene.yaml: not UTF-8 .*0xf6") as error:
        read_scene(box)
    assert "\n" not in str(error.value)
    assert not isinstance(error.value, UnicodeDecodeError)


def test_merged_keys_may_be_overridden(tmp_path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("base: &base {a: 1, b: 2}\nmore: {<<: *base, b: 3}\n")
    assert load_yaml(file)["more"] == {"a": 1, "b": 3}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</scene>", "", "scene.xml: not well-formed XML"),
        (
            '<integrator type="path">',
            '<integrator type="path">\n<boolean name="hide_emitters" value="true"/>',
            "hide_emitters is true",
        ),
        (
            '<integrator type="path">',
            '<integrator type="path">\n<boolean name="hide_emitters" value="True"/>',
            "hide_emitters is true",
        ),
        (
            '<integrator type="path">',
            '<integrator type="aov"><integrator type="path"><boolean name="hide_emitters" '
            'value="true"/></integrator></integrator><integrator type="path" name="unused">',
            "hide_emitters is true",
        ),
        *(
            (
                '<integrator type="path">',
                f'<integrator type="{kind}">',
                rf"scene\.xml, line 4: <integrator type='{kind}'>: .*; take one of path, volpath",
            )
            for kind in ("direct", "depth", "ptracer", "prb", "moment", "aov")
        ),
        (
            '<integrator type="path">',
            '<integrator type="aov"><integrator type="depth"/></integrator><integrator type="a">',
            "line 4: <integrator type='depth'>",
        ),
        ("integrator", "x", "not well-formed XML"),
        (
            'name="max_depth" value="4"',
            'name="max_depth" value="four"',
            "scene.xml: the integrator's max_depth is 'four'; expected an integer",
        ),
    ],
)
def test_bad_xml(box, old, new, message) -> None:
    edit(box, old, new, "scene.xml")
    with pytest.raises(ValueError, match=message):
        read_scene(box)


@pytest.mark.parametrize("kind", ["volpath", "volpathmis"])
def test_path_tracers_of_media_are_path_tracers(box, kind) -> None:
    edit(box, 'type="path"', f'type="{kind}"', "scene.xml")
    assert read_scene(box).max_depth == 4


def test_files_of_old_versions_of_mitsuba_have_other_names(box) -> None:
    edit(box, 'version="3.0.0"', 'version="0.6.0"', "scene.xml")
    edit(box, 'name="max_depth"', 'name="maxDepth"', "scene.xml")
    assert read_scene(box).max_depth == 4
    edit(
        box,
        "</integrator>",
        '<boolean name="hideEmitters" value="true"/></integrator>',
        "scene.xml",
    )
    with pytest.raises(ValueError, match="hide_emitters is true"):
        read_scene(box)


def test_no_folder(tmp_path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere.scene.yaml: no such file"):
        read_scene(tmp_path / "nowhere")


def test_mitsuba_is_not_imported() -> None:
    program = (
        "import sys, ngi.scene, ngi.render; ngi.scene.read_scene(sys.argv[1]);"
        "sys.exit('mitsuba' in sys.modules or 'drjit' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program, str(BOX)]).returncode == 0
