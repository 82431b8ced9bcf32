"""Which file `ngi video` writes, and that it replaces no other video's figures."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path

import pytest

from ngi.view.video import VideoOptions, main

pytest.importorskip("av", reason="the extra 'video' is missing")

MEASURED = {"network": {"srgb": 0.0}}


def measured_film(folder: Path, name: str, *, measured: object, **options: object) -> Path:
    """The JSON file of a film of the run in `folder`, of a version without supersampled edges."""
    written = asdict(VideoOptions(run="run, as it was named elsewhere")) | options
    del written["supersampled_edges"]
    runs = [{"folder": ".", "label": "network", "step": 12}]
    content = {"options": written, "runs": runs, "measure": "flicker", "measured": measured}
    (file := folder / name).write_text(json.dumps(content))
    return file


@pytest.mark.parametrize(
    ("name", "options", "before", "now"),
    [
        ("video_camera.json", (), "reference=256", "reference=0"),
        (
            "video_camera_supersampled.json",
            ("supersampled_edges=true", "reference=256"),
            "supersampled_edges=False",
            "supersampled_edges=True",
        ),
        (
            "video_static_3_supersampled.json",
            ("path=static", "hard_frame=3", "supersampled_edges=true", "seconds=2"),
            "path=camera, hard_frame=0, reference=256, seconds=8.0, supersampled_edges=False",
            "path=static, hard_frame=3, reference=0, seconds=2.0, supersampled_edges=True",
        ),
        (
            "video_camera.json",
            ("reference=256", "beside=elsewhere"),
            "beside=[]",
            "beside=['{here}/elsewhere']",
        ),
    ],
)
def test_what_another_video_measured_is_not_replaced(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    options: tuple[str, ...],
    before: str,
    now: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    figures = measured_film(tmp_path, name, measured=MEASURED, reference=256)
    content = figures.read_text()
    assert main([f"run={tmp_path}", *options]) == 2
    assert capsys.readouterr().err == (
        f"out: {figures} holds measurements with {before}; a video with "
        f"{now.format(here=tmp_path)} would replace them; give this video another name with out=…, "
        "or delete that file\n"
    )
    assert figures.read_text() == content


def test_nor_is_that_of_another_path_in_the_same_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (path := tmp_path / "tour.json").write_text("[[0, 0], [1, 1]]")
    figures = measured_film(
        tmp_path, "video_tour.json", measured=MEASURED, path="tour.json", reference=256
    )
    words = [f"run={tmp_path}", "path=tour.json", "reference=256"]
    content = json.loads(figures.read_text())
    for key_frames in (hashlib.sha256(path.read_bytes()).hexdigest()[:16], "0123456789abcdef"):
        figures.write_text(json.dumps({**content, "key_frames": key_frames}))
        assert main(words) == 2
        said = capsys.readouterr().err
        assert ("holds measurements with key_frames=" in said) == (key_frames[0:3] == "012")


@pytest.mark.parametrize(
    ("measured", "options"),
    [
        ({}, ("reference=64",)),
        (MEASURED, ("reference=256",)),
        (MEASURED, ("reference=256", "out=video_camera.mp4", "scene=elsewhere")),
    ],
    ids=["nothing measured", "the same again", "the same, named otherwise"],
)
def test_a_video_is_replaced_where_nothing_is_lost(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    measured: object,
    options: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    measured_film(tmp_path, "video_camera.json", measured=measured, reference=256)
    assert main(["run=.", *options]) == 2
    assert "settings.json: no such file" in capsys.readouterr().err  # the check has passed


@pytest.mark.parametrize(
    "content",
    [
        "{",
        "[]",
        '{"measure": "flicker"}',
        '{"measure": "flicker", "measured": {}, "options": [], "runs": [{"folder": "."}]}',
        '{"measure": "flicker", "measured": {}, "options": {}, "runs": []}',
        '{"measured": {}, "options": {}, "runs": [{"folder": "."}]}',
    ],
)
def test_what_is_no_videos_is_not_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str
) -> None:
    figures = tmp_path / "video_camera.json"
    figures.write_text(content)
    assert main([f"run={tmp_path}"]) == 2
    assert f"out: {figures}, the file for the measurements" in capsys.readouterr().err
    assert figures.read_text() == content
