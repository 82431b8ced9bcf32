"""What a scene that somebody else wrote may read, and what it may cost to read it."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import pytest

from ngi.scene import read_scene
from ngi.scene.loading import load
from ngi.scene.release import read_release
from ngi.scene.scene_files import ASSETS, named_files, read_scene_file
from tests.fuzz.seeds import RELEASES, SCENES, XML, write_seed


@pytest.fixture
def kit(tmp_path) -> Path:
    """A scene of the most kinds; beside its folder `secret.ply`, `secret.png` and `secret.xml`."""
    folder = tmp_path / "kit"
    write_seed(folder)
    (folder / "scene.yaml").write_bytes(SCENES[0])
    (tmp_path / "secret.xml").write_text("<scene version='3.0.0'/>")
    for kind in ("ply", "png"):
        shutil.copy(folder / f"a.{kind}", tmp_path / f"secret.{kind}")
        (folder / f"link.{kind}").symlink_to(tmp_path / f"secret.{kind}")
    (folder / "around").symlink_to(tmp_path)
    return folder


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


OUTSIDE = ["../secret.{}", "{place}/secret.{}", "link.{}", "around/secret.{}", "x/../../secret.{}"]
MESH, SECRET = '<string name="filename" value="$mesh"/>', '<string name="filename" value="{}"/>'
XML_PLACES = [  # what is replaced, by what, and the kind of file
    (MESH, SECRET, "ply"),
    ('<default name="mesh" value="a.ply"/>', '<default name="mesh" value="{}"/>', "ply"),
    (MESH, '<default name="key" value="filename"/><string name="$key" value="{}"/>', "ply"),
    ('<string name="filename" value="a.png"/>', SECRET, "png"),
    ("</scene>", '<include filename="{}"/></scene>', "xml"),
    ("</scene>", '<emitter type="envmap">' + SECRET + "</emitter></scene>", "png"),
    ('<rgb name="reflectance" value="0.1, 0.4, 0.3"/>', '<spectrum filename="{}"/>', "ply"),
]


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize(("old", "new", "kind"), XML_PLACES)
def test_no_element_names_a_file_elsewhere(kit, monkeypatch, name, old, new, kind) -> None:
    (kit / "x").mkdir()
    (kit / "link.xml").symlink_to(kit.parent / "secret.xml")
    edit(kit / "scene.xml", old, new.format(name.format(kind, place=kit.parent)))
    with pytest.raises(
        ValueError, match=rf"scene\.xml, line \d+: <\w+> names .*{ASSETS}="
    ) as error:
        read_scene(kit)
    assert str(kit.parent / f"secret.{kind}") in str(error.value)
    monkeypatch.setenv(ASSETS, os.pathsep.join(["/nowhere", str(kit.parent)]))
    assert read_scene(kit).dimensions == 15


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize(
    ("old", "key", "kind"),
    [("scene.xml", "scene", "xml"), ("b.png", "variables", "png"), ("b.ply", "variables", "ply")],
)
def test_no_key_names_a_file_elsewhere(kit, monkeypatch, name, old, key, kind) -> None:
    (kit / "x").mkdir()
    shutil.copy(kit / "scene.xml", kit.parent / "secret.xml")
    (kit / "link.xml").symlink_to(kit.parent / "secret.xml")
    for file in ("a.ply", "a.png"):
        shutil.copy(kit / file, kit.parent / file)
    edit(kit / "scene.yaml", old, name.format(kind, place=kit.parent))
    with pytest.raises(ValueError, match=rf"scene\.yaml: {key} names .*{ASSETS}="):
        read_scene(kit)
    monkeypatch.setenv(ASSETS, str(kit.parent))
    read_scene(kit)


@pytest.mark.parametrize("name", OUTSIDE)
def test_the_authors_format_names_no_file_elsewhere(kit, monkeypatch, name) -> None:
    (kit / "x").mkdir()
    text = RELEASES[0].decode().replace("a.ply", name.format("ply", place=kit.parent))
    (kit / "scene.xml").write_text(text)
    with pytest.raises(ValueError, match=rf"scene\.xml, line \d+: <shape> names .*{ASSETS}="):
        read_release(kit)
    monkeypatch.setenv(ASSETS, str(kit.parent))
    read_release(kit)


def test_a_scene_yaml_that_is_a_link_elsewhere_is_not_read(kit) -> None:
    (kit / "scene.yaml").rename(kit.parent / "secret.yaml")
    (kit / "scene.yaml").symlink_to(kit.parent / "secret.yaml")
    with pytest.raises(ValueError, match=f"scene.yaml.* outside of the scene's folder .*{ASSETS}"):
        read_scene(kit)


def test_a_link_to_the_folder_itself_is_fine(kit) -> None:
    (kit.parent / "other").symlink_to(kit)
    assert read_scene(kit.parent / "other").scene_hash == read_scene(kit).scene_hash


@pytest.mark.parametrize("extra", ['<path value=".."/>', '<string name="k" value="../../etc/a"/>'])
def test_no_other_way_leads_to_files(kit, extra) -> None:
    for text, read in ((XML, read_scene), (RELEASES[0].decode(), read_release)):
        (kit / "scene.xml").write_text(text.replace("</scene>", f"{extra}</scene>"))
        with pytest.raises(ValueError, match=r"scene\.xml, line \d+: <(path|string)"):
            read(kit)


def test_what_is_no_regular_file_is_not_opened(kit) -> None:
    os.mkfifo(kit / "pipe.ply")
    edit(kit / "scene.xml", 'value="a.ply"', 'value="pipe.ply"')
    with pytest.raises(FileNotFoundError, match=r"names 'pipe\.ply'"):
        read_scene(kit)


def test_included_files_may_name_what_lies_beside_them(kit) -> None:
    """Where the scene's folder, in which Mitsuba looks, has nothing of the name."""
    inner = kit / "inner"
    inner.mkdir()
    (kit / "a.ply").rename(inner / "mesh.ply")
    shutil.copy(inner / "mesh.ply", kit / "a.ply")
    (inner / "more.xml").write_text(
        '<scene version="3.0.0"><default name="depth" value="9"/><shape type="ply" id="included">'
        '<string name="filename" value="mesh.ply"/></shape></scene>'
    )
    edit(kit / "scene.xml", "</scene>", '<include filename="inner/more.xml"/></scene>')
    document = read_scene_file(kit / "scene.xml")
    names = [name for name, _ in named_files(document)]
    assert names == ["inner/more.xml", "a.png", "a.ply", "inner/mesh.ply"]
    assert read_scene(kit).max_depth == 4, "what includes a file has the say"
    from ngi.machine.backend import activate

    activate("scalar")
    assert "included" in {shape.id() for shape in load(document).shapes()}
    edit(inner / "more.xml", "mesh.ply", "../../secret.ply")
    with pytest.raises(ValueError, match=r"more\.xml, line 1: <shape> names .*outside of"):
        read_scene(kit)


@pytest.mark.parametrize(
    "content", ['<include filename="{}.xml"/>', '<include filename="{}.xml"/>' * 2]
)
def test_includes_that_never_end(kit, content) -> None:
    for one, other in (("one", "two"), ("two", "one")):
        text = f'<scene version="3.0.0">{content.format(other, other)}</scene>'
        (kit / f"{one}.xml").write_text(text)
    edit(kit / "scene.xml", "</scene>", '<include filename="one.xml"/></scene>')
    with pytest.raises(ValueError, match=r"scene\.xml: <include> .*a loop"):
        read_scene(kit)


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 20))
ENTITIES = [
    f'<!DOCTYPE scene [<!ENTITY l0 "ha">{LAUGHS}]><scene>&l19;</scene>',
    '<!DOCTYPE scene [<!ENTITY a SYSTEM "/etc/passwd">]><scene>&a;</scene>',
    '<!DOCTYPE scene [<!ENTITY % a SYSTEM "http://127.0.0.1/a"> %a;]><scene/>',
]
NAMES = "".join(f'<default name="n{i}" value="{f"$n{i - 1}" * 10}"/>' for i in range(1, 20))
BOMBS = [
    *((text, "declares the entity") for text in ENTITIES),
    (f'<scene><default name="n0" value="ha"/>{NAMES}</scene>', r"\$names may stand for"),
    ("<scene>" + "<shape>" * 5000 + "</shape>" * 5000 + "</scene>", "elements in more than"),
    ('<?xml version="1.0" encoding="rot13"?><scene/>', "rot13"),
]


@pytest.mark.parametrize(("text", "message"), BOMBS)
@pytest.mark.parametrize("read", [read_scene, read_release])
def test_bombs_of_xml_are_refused_at_once(kit, text, message, read) -> None:
    (kit / "scene.xml").write_text(text)
    begun = time.monotonic()
    with pytest.raises(ValueError, match=rf"scene\.xml(, line \d+)?: .*{message}"):
        read(kit)
    assert time.monotonic() - begun < 5


ALIASES = "a0: &a0 [x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12)
)
MERGES = "m0: &m0 {k: 1}\n" + "".join(
    f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 10)}]}}\n" for i in range(1, 12)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ALIASES, "more than 1,000,000 values"),
        (MERGES, "more than 1,000,000 values"),
        ("[" * 5000, "more than 64 levels"),
        ("a: &a [*a]", "an alias within what it stands for"),
        ("a: !!python/object/apply:os.system ['true']", "could not determine a constructor"),
        ("a: !!int ''", "broken YAML"),
        ("a: !!timestamp x", "broken YAML"),
        ("a: 2001-13-45", "broken YAML"),
        ("a: " + "1" * 5000, "broken YAML"),
    ],
)
def test_bombs_of_yaml_are_refused_at_once(kit, text, message) -> None:
    (kit / "scene.yaml").write_text(text)
    begun = time.monotonic()
    with pytest.raises(ValueError, match=rf"scene\.yaml(, line \d+)?: .*{message}") as error:
        read_scene(kit)
    assert time.monotonic() - begun < 5
    assert len(str(error.value)) < 1000
