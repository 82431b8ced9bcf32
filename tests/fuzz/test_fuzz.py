"""A few of the fuzzer's inputs, and all that it has found; `python -m tests.fuzz` makes more."""

from __future__ import annotations

import logging
import re
from collections import Counter
from contextlib import suppress
from random import Random
from xml.etree import ElementTree

import pytest

from ngi.scene import read_scene
from ngi.scene.loading import load
from ngi.scene.release import read_release
from ngi.scene.scene_files import read_scene_file
from ngi.scene.variable_scene import VariableScene
from tests.fuzz.fuzzer import fuzz, make_input, read_one
from tests.fuzz.mutations import mutated
from tests.fuzz.runs import LOGS, RUN_FILES, good_files
from tests.fuzz.seeds import RELEASES, SCENES, XML, write_seed
from tests.scene.release_files import TETRAHEDRON


@pytest.fixture(autouse=True)
def _quiet(caplog) -> None:
    caplog.set_level(logging.ERROR)


@pytest.mark.parametrize("text", SCENES)
def test_seeds_are_good_scenes(tmp_path, text) -> None:
    write_seed(tmp_path)
    (tmp_path / "scene.yaml").write_bytes(text)
    assert read_scene(tmp_path).dimensions in (9, 15)


@pytest.mark.parametrize("text", RELEASES)
def test_seeds_are_good_scenes_of_the_authors(tmp_path, text) -> None:
    write_seed(tmp_path)
    (tmp_path / "scene.xml").write_bytes(text)
    assert read_release(tmp_path).dimensions > 1


def test_damaged_runs_are_left_out_and_that_is_noticed(tmp_path, monkeypatch) -> None:
    kinds = Counter(make_input(number)[0] for number in range(300))
    assert {*RUN_FILES, "scene.yaml", "scene.xml", "release"} == {*kinds}
    whole = good_files()
    assert all(read_one(tmp_path, kind, whole[kind]) is None for kind in LOGS)
    cut = whole["chains.bin"][:-1]
    assert read_one(tmp_path, "chains.bin", cut) is None
    monkeypatch.setattr("analysis.runs.check_logs", lambda *_: None)
    assert "damage is not noticed" in str(read_one(tmp_path, "chains.bin", cut))


def test_ranges_are_made_negative_and_tags_put_elsewhere() -> None:
    made = [mutated(Random(number), RELEASES[0], xml=True) for number in range(200)]
    assert any(re.search(rb'name="range_bounds" value="[^"]*-\d', text) for text in made)
    assert any(re.search(rb'name="max_bounds"', text) for text in made)
    assert any(_tag_in_a_film(text) for text in made)


def _tag_in_a_film(text: bytes) -> bool:
    with suppress(ElementTree.ParseError):
        return ElementTree.fromstring(text).find(".//film/*[@name='range_bounds']") is not None
    return False


def test_bad_inputs_are_refused_with_a_message(tmp_path) -> None:
    assert not list(fuzz(range(300), tmp_path / "kit"))


def test_what_can_be_read_is_built_or_refused(tmp_path) -> None:
    from ngi.machine.backend import activate

    def build(description) -> None:
        activate("scalar")
        VariableScene(description).apply([0.5] * description.dimensions)

    assert not list(fuzz(range(12), tmp_path / "kit", use=build, longest=60))


FOUND = [  # what the fuzzer has found, by what it raised
    ("scene.yaml", SCENES[1].replace(b"size: [2, 2]", b"size: [100000, 100000]")),  # a hang
    ("release", RELEASES[0].replace(b'<rotate x="1"', b'<rotate x="0"')),  # RuntimeWarning
    ("release", RELEASES[2].replace(b'name="reflectance"', b'name="other"')),  # StopIteration
    ("release", RELEASES[2].replace(b"<texture ", b"<ref ").replace(b"</texture>", b"</ref>")),
    ("release", RELEASES[0].replace(b'scale value="6"', b'scale value="1e300"')),
    ("release", RELEASES[1].replace(b'<ref id="balls"/>', b'<ref id="var_choice"/>')),
    (
        "release",  # RecursionError: an instance of the group that it is part of
        RELEASES[1].replace(
            b'id="balls">', b'id="balls"><shape type="instance"><ref id="balls"/></shape>'
        ),
    ),
]


@pytest.mark.parametrize(("kind", "text"), FOUND)
def test_what_the_fuzzer_found(tmp_path, kind, text) -> None:
    assert text not in (*SCENES, *RELEASES, XML.encode())
    write_seed(tmp_path)
    assert read_one(tmp_path, kind, text) is None


def test_a_bitmap_without_a_file_does_not_crash_mitsuba(tmp_path) -> None:
    write_seed(tmp_path)
    named = '<string name="filename" value="a.png"/>'
    (tmp_path / "scene.xml").write_text(XML.replace(named, "").replace(f"\n  {named}", ""))
    with pytest.raises(ValueError, match=r"scene\.xml, line 12: <texture type='bitmap'"):
        load(read_scene_file(tmp_path / "scene.xml"))


PLY = "ply\nformat {} 1.0\nelement vertex {}\n{}end_header\n{}"
XYZ = "property float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (PLY.format("ascii", 10**15, XYZ, "0 0 0\n"), "no face has a vertex"),
        (PLY.format("binary_little_endian", 10**15, XYZ, "0"), r"a\.ply: cannot be read as PLY"),
        (PLY.format("ascii", -1, XYZ, ""), "no face has a vertex"),
        (PLY.format("ascii", 2, XYZ, "0 0 0\n0 0"), "cannot be read as PLY"),
        (PLY.format("ascii", 1, XYZ, "0 0 a\n"), "cannot be read as PLY"),
        (TETRAHEDRON.replace("0 0 3", "0 0 nan", 1), "reaches farther than"),
        (PLY.format("ascii", 1, XYZ.replace(" y", " x"), "0 0 0"), "cannot be read as PLY"),
        (PLY.format("binary_little_endian", 1, XYZ * 2, "0" * 99), "cannot be read as PLY"),
    ],
)
def test_meshes_of_nonsense(tmp_path, mesh, message) -> None:
    write_seed(tmp_path)
    (tmp_path / "scene.xml").write_bytes(RELEASES[0])
    (tmp_path / "a.ply").write_text(mesh)
    with pytest.raises(ValueError, match=message):
        read_release(tmp_path)
