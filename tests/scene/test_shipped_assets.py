"""What every shipped scene folder promises: made by its script, complete, small and sound."""

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ngi.scene import read_scene, scenes
from tests.scene.ply import read_ply

SCENES = Path(__file__).parents[2] / "scenes"
FOLDERS = sorted(path.parent for path in SCENES.glob("*/scene.yaml"))
ASSETS = (".ply", ".jpg", ".png", ".exr", ".hdr")
MEGABYTE = 1_000_000

DIMENSIONS = {  # shutters is ours, the others are the paper's, see docs/scenes.md
    "archviz": 71,
    "bathroom": 8,
    "bedroom": 6,
    "chess": 128,
    "cornell-box": 12,
    "living-room": 7,
    "mirror": 2,
    "salon-5": 5,
    "salon-7": 7,
    "salon-9": 9,
    "salon-10": 10,
    "salon-25": 25,
    "shutters": 9,
    "spaceship": 8,
    "sphere-caustic": 12,
    "veach-door": 6,
    "veach-egg": 9,
}
SAMPLES_PER_PIXEL = {  # while training, the paper's Table 1
    "sphere-caustic": 200,
    "living-room": 400,
    "bedroom": 400,
    "veach-door": 600,
    "bathroom": 800,
    "spaceship": 1200,
    "veach-egg": 24000,
}

KEPT_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(2**25), "MALLOC_TRIM_THRESHOLD_": str(2**31 - 1)}
"""Of glibc: a large array has the last one's memory; its page faults took half of the time."""

by_folder = pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)


def test_all_scenes_are_there() -> None:
    shipped = {name: s for name, s in scenes().items() if SCENES in Path(s["folder"]).parents}
    dimensions = {name: read_scene(**arguments).dimensions for name, arguments in shipped.items()}
    assert dimensions == DIMENSIONS
    for name, samples in SAMPLES_PER_PIXEL.items():
        assert read_scene(**shipped[name]).samples_per_pixel == samples


def test_scenes_are_light_enough_for_the_repository() -> None:
    assert sum(f.stat().st_size for f in SCENES.rglob("*") if f.is_file()) < 25 * MEGABYTE


@by_folder
def test_files_are_what_the_script_makes(folder, tmp_path) -> None:
    subprocess.run(
        [sys.executable, folder / "make.py", "--folder", tmp_path],
        env={**os.environ, **KEPT_MEMORY},
        check=True,
        timeout=120,
    )
    made = {path.name for path in tmp_path.iterdir()}
    assert made >= {path.name for path in folder.iterdir() if path.suffix in ASSETS}
    for name in sorted(made):
        ours, theirs = tmp_path / name, folder / name
        if ours.suffix == ".ply":
            for a, b in zip(read_ply(ours), read_ply(theirs), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-5)
        elif ours.suffix in (".jpg", ".png"):
            a, b = (np.asarray(Image.open(path), dtype=float) for path in (ours, theirs))
            # JPEG libraries may round differently; another picture would differ by far more.
            assert a.shape == b.shape
            assert np.abs(a - b).mean() < 0.5
        else:
            assert ours.read_bytes() == theirs.read_bytes()


@by_folder
def test_every_asset_is_used(folder) -> None:
    root = ElementTree.parse(folder / "scene.xml").getroot()
    named = {e.get("value") for e in root.iter("string") if e.get("name") == "filename"}
    description = read_scene(folder)
    named |= {name for variable in description.variables for name in variable.files}
    assert named == {path.name for path in folder.iterdir() if path.suffix in ASSETS}


@by_folder
def test_meshes_are_sound(folder) -> None:
    triangles_of_all = 0
    for path in folder.glob("*.ply"):
        table, triangles = read_ply(path)
        corners = table[triangles][..., :3].astype(np.float64)
        area = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1
        )
        assert np.isfinite(table).all()
        # Mitsuba gives a triangle without area a NaN as its face normal.
        assert (area > 0).all(), path.name
        triangles_of_all += len(triangles)
    assert triangles_of_all <= 60_000


@by_folder
def test_camera_and_ids(folder) -> None:
    root = ElementTree.parse(folder / "scene.xml").getroot()
    (sensor,) = root.findall("sensor")
    assert sensor.get("id") == "camera"
    unnamed = [bsdf for bsdf in root.findall("bsdf") if not bsdf.get("id")]
    assert not unnamed
    assert len(read_scene(folder).hard_frames) == 10
    assert len(read_scene(folder).camera_path) >= 6
