"""Variants of a scene, in which only its first components vary, and the scenes known by name."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from ngi.scene import read_scene, scenes
from ngi.scene.yaml_keys import load_yaml
from tests.render.box import BOX


@pytest.fixture
def box(tmp_path):
    def make(variants, name="box"):
        folder = Path(shutil.copytree(BOX, tmp_path / name))
        text = (folder / "scene.yaml").read_text()
        (folder / "scene.yaml").write_text(f"{text}\nvariants: {variants}\n")
        return folder

    return make


@pytest.mark.parametrize(("dimensions", "variables"), [(3, 1), (6, 2), (8, 3), (9, 4), (10, 5)])
def test_first_components_vary(box, dimensions, variables) -> None:
    folder = box([3, 6, 8, 9, 10])
    whole, variant = read_scene(folder), read_scene(folder, dimensions=dimensions)
    assert variant.dimensions == dimensions
    assert variant.name == f"box-{dimensions}"
    assert variant.component_names == whole.component_names[:dimensions]
    assert variant.variables == whole.variables[:variables]
    assert variant.camera_path == tuple(v[:dimensions] for v in whole.camera_path)
    assert variant.hard_frames == tuple(v[:dimensions] for v in whole.hard_frames)
    assert variant.scene_hash == whole.scene_hash
    for a, b in zip(
        variant.values(np.full(dimensions, 0.3)), whole.values(np.full(10, 0.3)), strict=False
    ):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("dimensions", [0, 1, 7, 11])
def test_variants_end_where_a_variable_ends(box, dimensions) -> None:
    with pytest.raises(ValueError, match=rf"scene.yaml: variants: {dimensions} components are no"):
        read_scene(box([3]), dimensions=dimensions)


@pytest.mark.parametrize(
    ("variants", "message"),
    [
        ("[7]", "variants: 7 components are no whole number"),
        ("[3, 0]", r"variants is \[3, 0\]; expected positive integers"),
        ("[true]", r"variants is \[True\]; expected positive integers"),
        ("[1.5]", r"variants is \[1.5\]; expected positive integers"),
        ("3", "variants is 3; expected list"),
    ],
)
def test_wrong_variants(box, variants, message) -> None:
    with pytest.raises(ValueError, match=rf"scene.yaml: {message}"):
        read_scene(box(variants))


def test_scenes_are_known_by_name_and_variant(box, tmp_path, monkeypatch) -> None:
    folder, other = box([3, 10], "several"), box([], "single")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "scene.yaml").write_text("variants: [")
    (tmp_path / "empty").mkdir()
    monkeypatch.setenv("NGI_SCENES", str(tmp_path))
    known = scenes()
    assert known["several-3"] == {"folder": str(folder), "dimensions": 3}
    assert known["several-10"] == {"folder": str(folder), "dimensions": 10}
    assert known["single"] == {"folder": str(other), "dimensions": None}
    assert known["broken"] == {"folder": str(tmp_path / "broken"), "dimensions": None}
    assert not {"several", "empty"} & known.keys()
    assert read_scene(**known["several-3"]).dimensions == 3
    with pytest.raises(ValueError, match=r"scene.yaml, line \d+: broken YAML"):
        read_scene(**known["broken"])


def test_shipped_scenes_are_known_by_name() -> None:
    assert {"sphere-caustic", "mirror"} <= scenes().keys()


def test_a_scene_that_nobody_can_read_is_listed_and_harms_no_other(tmp_path, monkeypatch) -> None:
    (tmp_path / "folder" / "scene.yaml").mkdir(parents=True)
    monkeypatch.setenv("NGI_SCENES", str(tmp_path))
    assert {"folder", "mirror"} <= scenes().keys()
    with pytest.raises((OSError, ValueError), match=r"folder.scene\.yaml"):
        read_scene(**scenes()["folder"])


def test_only_scenes_with_variants_are_read_for_their_names(box, tmp_path, monkeypatch) -> None:
    box([3, 10], "several")
    shutil.copytree(BOX, tmp_path / "single")
    monkeypatch.setattr(
        "ngi.scene.folder.scene_folders", lambda: {p.name: p for p in [*tmp_path.iterdir()]}
    )
    read = []
    monkeypatch.setattr(
        "ngi.scene.folder.load_yaml", lambda path: read.append(path) or load_yaml(path)
    )
    assert scenes().keys() == {"several-3", "several-10", "single"}
    assert read == [tmp_path / "several" / "scene.yaml"]
