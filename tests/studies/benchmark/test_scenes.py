from pathlib import Path

import pytest

from ngi.files.resources import scene_folders
from ngi.studies.benchmark.scenes import one_per_folder, released, shipped


def test_of_variants_the_one_with_the_most_variables_is_measured() -> None:
    names = one_per_folder()
    assert len(names) == len(scene_folders())
    assert [name for name in names if name.startswith("salon")] == ["salon-25"]
    [scene] = shipped(["salon-25"])
    assert scene.read().dimensions == 25


def test_a_folder_without_a_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"no scene\.xml is there"):
        released(tmp_path)


def test_the_authors_scenes_are_named_after_their_folders(tmp_path: Path) -> None:
    (tmp_path / "veach").mkdir()
    (tmp_path / "veach" / "scene.xml").touch()
    scene = released(tmp_path / "veach")
    assert scene.name == "release veach"
    assert scene.overrides == ("scene=release", f"scene.path={tmp_path / 'veach'}")
