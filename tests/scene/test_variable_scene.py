"""A scene changed in place against one that was written with the same values."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from ngi.machine.backend import activate, llvm_problem, mi
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.render.box import BOX

AUTHORED = np.array([0.6, 0.1, 0.1, 0.5, 0.25, 0.5, 0.5, 0.5, 0.25, 1 / 3])
"""The v at which the box is as scene.xml says."""


@pytest.fixture(scope="module", params=["llvm", "scalar"])
def scene(request):
    if request.param == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    activate(request.param)
    return VariableScene(read_scene(BOX))


def render(scene):
    return np.array(mi.render(scene, spp=16, seed=3))


PROPERTIES = [
    ("nothing", slice(0), [], "<scene", "<scene"),
    ("albedo", slice(3), [0.2, 0.9, 0.4], 'value="0.6, 0.1, 0.1"', 'value="0.2, 0.9, 0.4"'),
    (
        "translation of a sphere",
        slice(3, 6),
        [1, 0.5, 0.25],
        'x="0" y="0.5" z="0"',
        'x="0.4" y="0.7" z="-0.2"',
    ),
    (
        "translation of an instance",
        slice(6, 8),
        [1, 0],
        'x="0.5" y="0.2" z="-0.4"',
        'x="0.7" y="0.2" z="-0.7"',
    ),
    (
        "roughness",
        slice(8, 9),
        [0.75],
        '<float name="alpha" value="0.2"/>',
        '<float name="alpha" value="0.4"/>',
    ),
    ("intensity", slice(9, 10), [1], 'value="10, 8, 6"', 'value="20, 16, 12"'),
]


@pytest.mark.parametrize(("which", "part", "v", "old", "new"), PROPERTIES)
def test_update_equals_fresh_load(scene, which, part, v, old, new) -> None:
    changed = AUTHORED.copy()
    changed[part] = v
    scene.apply(np.linspace(0, 1, 10))  # somewhere else first
    scene.apply(changed)
    updated = render(scene.scene)
    text = (BOX / "scene.xml").read_text()
    assert old in text
    fresh = render(mi.load_string(text.replace(old, new), optimize=False))
    close = np.isclose(updated, fresh, rtol=1e-3, atol=1e-4)
    # A path may take another turn where rounding differs.
    assert close.mean() > 0.99, which
    np.testing.assert_allclose(updated.mean(), fresh.mean(), rtol=5e-3)
    if which != "nothing":
        scene.apply(AUTHORED)
        assert np.isclose(render(scene.scene), updated, rtol=1e-3).mean() < 0.99


def test_only_what_changed_is_written(scene, monkeypatch) -> None:
    scene.apply(AUTHORED)
    written = []
    write = scene._parameters.write
    monkeypatch.setattr(
        scene._parameters, "write", lambda key, value: (written.append(key), write(key, value))
    )
    scene.apply(AUTHORED)
    assert written == []
    moved = AUTHORED.copy()
    moved[[4, 8]] = 0.9
    scene.apply(moved)
    assert sorted(written) == ["ball.to_world", "metal.brdf_0.alpha.value"]


def test_what_was_broken_off_is_written_again(scene, monkeypatch) -> None:
    """Mitsuba was not told of it: the same v would be taken for what is there."""
    scene.apply(AUTHORED)
    before = render(scene.scene)
    changes = scene.changes

    def full() -> None:
        raise RuntimeError("out of memory")

    moved = AUTHORED.copy()
    moved[3:6] = [1, 0.5, 0.25]
    with monkeypatch.context() as broken:
        broken.setattr(scene._parameters, "update", full)
        with pytest.raises(RuntimeError, match="out of memory"):
            scene.apply(moved)
    assert scene.changes > changes
    scene.apply(moved)
    there = render(scene.scene)
    scene.apply(AUTHORED)
    np.testing.assert_array_equal(render(scene.scene), before)
    scene.apply(moved)
    np.testing.assert_array_equal(render(scene.scene), there)
    assert not np.array_equal(there, before)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("object: ball", "object: bal", "no object has the id 'bal' .* nearest: ball"),
        (
            "object: metal, property: roughness",
            "object: left_wall, property: roughness",
            r"'left_wall' \(SmoothDiffuse\) has no parameter alpha",
        ),
        ("object: lamp", "object: ball", "'ball' .* name an emitter"),
        ("object: figure, ", "object: metal, ", "its place cannot vary"),
    ],
)
@pytest.mark.usefixtures("scene")
def test_unknown_objects_and_properties(tmp_path, old, new, message) -> None:
    folder = Path(shutil.copytree(BOX, tmp_path / "box"))
    text = (folder / "scene.yaml").read_text()
    assert old in text
    (folder / "scene.yaml").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=message):
        VariableScene(read_scene(folder))


@pytest.mark.usefixtures("scene")
def test_reflectance_of_one_number_is_refused(tmp_path) -> None:
    folder = Path(shutil.copytree(BOX, tmp_path / "box"))
    text = (folder / "scene.xml").read_text()
    old = '<rgb name="reflectance" value="0.6, 0.1, 0.1"/>'
    assert old in text
    (folder / "scene.xml").write_text(
        text.replace(old, '<spectrum name="reflectance" value="0.6"/>')
    )
    with pytest.raises(ValueError, match=r"'left_wall': .* 1 number.* as <rgb>, not as <spectrum>"):
        VariableScene(read_scene(folder))
