"""A run knows where its scene is, wherever it is opened from."""

import json
import re
import shutil
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from ngi.config.configuration import scene_place, scene_record
from ngi.files.resources import root
from ngi.learn import RunFolder
from ngi.view import trained_run
from ngi.view.path_traced_run import PathTracedRun, open_run
from ngi.view.run_settings import RENAMED, describe_scene, made_by, make_renderer
from ngi.view.trained_run import TrainedRun
from tests.config.command_line import composed

SETTINGS: dict[str, Any] = {
    "scene": {"name": "my-lamp", "hash": "0"},
    "renderer": {"_target_": "ngi.render.workers.mitsuba_renderer"},
}


def begun(folder: Path, scene: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run of a scene below $NGI_SCENES, which is not set when the run is opened."""
    shutil.copytree(root() / "scenes" / "mirror", scene)
    monkeypatch.setenv("NGI_SCENES", str(scene.parent))
    place = scene_record(composed(f"scene={scene.name}"))
    monkeypatch.delenv("NGI_SCENES")
    run = RunFolder(folder, settings=SETTINGS)
    run.begin(scene=place)
    run.close()
    return folder


def test_a_run_finds_its_scene_without_being_told(tmp_path, monkeypatch) -> None:
    scene = tmp_path / "elsewhere" / "my-lamp"
    folder = begun(tmp_path / "run", scene, monkeypatch)
    described = describe_scene(folder, SETTINGS, None)
    assert described is not None
    assert described.document.path == scene / "scene.xml"
    shutil.rmtree(scene)
    with pytest.raises(ValueError, match=rf"'my-lamp' is not found, nor at {scene}: set"):
        describe_scene(folder, SETTINGS, None)


@pytest.mark.parametrize(
    ("changed", "opened"),
    [
        ("samples_per_pixel: 512 # more\n", True),
        ("hard_frames: [[0.1, 0.2]]\n", True),
        ("camera_path: [[0.1, 0.2], [1, 1]]\n# a comment\n", True),
        ("bounds: {minimum: [-4, 0, -2.2], maximum: [3.4, 2.8, 2.6]}\n", False),
    ],
)
def test_what_changes_no_pixel_leaves_a_network_what_it_was(
    tmp_path, monkeypatch, changed: str, opened: bool
) -> None:
    scene = tmp_path / "elsewhere" / "my-lamp"
    folder = begun(tmp_path / "run", scene, monkeypatch)
    before = describe_scene(folder, SETTINGS, None)
    assert before is not None
    settings = {**SETTINGS, "scene": {"name": "my-lamp", "hash": before.scene_hash}}
    key, text = changed.split(":")[0], (scene / "scene.yaml").read_text()
    entries = re.split(r"^(?=\w)", text, flags=re.MULTILINE)
    others = [entry for entry in entries if entry.split(":")[0] != key]
    (scene / "scene.yaml").write_text("".join([*others, changed]))
    after = describe_scene(folder, settings, None)
    assert after is not None
    assert after.scene_hash != before.scene_hash
    with nullcontext() if opened else pytest.raises(ValueError, match="an earlier version of"):
        make_renderer(folder, settings, after)
    (folder / "scene.json").unlink()  # as a run of before has none, or not all of it
    with pytest.raises(ValueError, match="was trained on an earlier version"):
        make_renderer(folder, settings, after)


def test_where_the_scene_is_is_no_part_of_the_identity(tmp_path, monkeypatch) -> None:
    folder = begun(tmp_path / "run", tmp_path / "elsewhere" / "my-lamp", monkeypatch)
    identity = (folder / "settings.json").read_text()
    run = RunFolder(folder, settings=SETTINGS)
    run.begin(scene={"_target_": "ngi.scene.read_scene", "folder": "/moved"})
    run.close()
    assert (folder / "settings.json").read_text() == identity


def test_of_a_folder_of_runs_some_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"name the folder of one run, outputs/…/seed=0"):
        open_run(tmp_path)
    for seed in range(4):
        folder = tmp_path / "mirror" / f"seed={seed}"
        folder.mkdir(parents=True)
        (folder / "settings.json").touch()
    with pytest.raises(FileNotFoundError) as raised:
        open_run(tmp_path)
    named = str(raised.value).partition("the folder of one run, ")[2].split(" or ")
    assert len(named) == 3
    assert {*named} < {str(tmp_path / "mirror" / f"seed={seed}") for seed in range(4)}


@pytest.mark.parametrize("content", ["[]", "{}", "3", '{"scene": 3}'])
@pytest.mark.parametrize("open_folder", [TrainedRun.open, PathTracedRun.open, open_run])
def test_settings_that_are_no_runs_are_named(
    tmp_path, monkeypatch, open_folder, content: str
) -> None:
    (tmp_path / "settings.json").write_text(content)
    (tmp_path / "result.json").write_text("{}")
    monkeypatch.setattr(trained_run, "newest_checkpoint", lambda _: {})
    with pytest.raises(ValueError, match=f"{tmp_path}: settings.json or result.json is damaged"):
        open_folder(tmp_path)


READER = '"_target_": "ngi.scene.read_scene"'


@pytest.mark.parametrize(
    "content",
    ["{", "[]", "{}", '{"_target_": "os.system"}', f"{{{READER}}}", f'{{{READER}, "folder": 3}}'],
)
def test_a_damaged_place_is_named(tmp_path, content: str) -> None:
    (tmp_path / "scene.json").write_text(content)
    with pytest.raises(ValueError, match=r"scene\.json is damaged.*delete it"):
        describe_scene(tmp_path, SETTINGS, None)


def test_closed_formulas_have_no_place() -> None:
    assert scene_place(composed("renderer=analytic")) is None


def test_a_scene_of_the_authors_is_found_by_its_absolute_path(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    place = scene_place(composed("scene=release", "scene.path=theirs"))
    assert place is not None
    assert json.loads(json.dumps(place)) == {
        "_target_": "ngi.scene.release.read_release",
        "path": str(tmp_path / "theirs"),
    }


@pytest.mark.parametrize("old", RENAMED)
def test_what_an_older_run_names_is_found_where_it_is_now(old: str) -> None:
    group = "model" if ".models." in old else "data"
    assert made_by({group: {"_target_": old}}, group).__name__ == old.rpartition(".")[2]


def test_modules_of_one_s_own_are_taken_where_they_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own_network.py").write_text("class Network:\n    pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    settings = {"model": {"_target_": "own_network.Network"}}
    for named in ("", "other", "own"):
        monkeypatch.setenv("NGI_TRUSTED", named)
        with pytest.raises(ValueError, match=r"it is your own code, set NGI_TRUSTED=own_network"):
            made_by(settings, "model")
    monkeypatch.setenv("NGI_TRUSTED", "other, own_network")
    assert made_by(settings, "model").__name__ == "Network"
    for target in ("", 3, None, "os.system"):
        with pytest.raises(ValueError, match="no option of the group model names it"):
            made_by({"model": {"_target_": target}}, "model")
