"""`ngi video` on runs of closed formulas, as a user starts it."""

import json
import sys
from math import log10
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from PIL import Image

from ngi.files.extras import install_command
from ngi.view import film
from ngi.view.video import main
from tests.learn.command_line import run, run_module

av = pytest.importorskip("av", reason="the extra 'video' is missing")

RUN = "run.folder=run"
NOISE = 0.5
"""Of the renderer: relative standard deviation at one sample per pixel."""
SIZE, FACTOR = 48, 5
"""Pixels of a picture, and how often each is repeated in the video."""
LEFT, TOP, GAP = 12, 38, 12
"""Of the pictures in a frame."""


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs, of the same scene: 'run' and 'method=other'; and 'plain', of one without noise."""
    folder = tmp_path_factory.mktemp("trained")
    noisy = f"+renderer.noise={NOISE}"
    for name, overrides in (
        ("run", (noisy,)),
        ("method=other", (noisy, "seed=1")),
        ("plain", ()),
        ("paths", (noisy, "method=path_tracing_8spp")),
    ):
        status, output = run(folder, f"run.folder='{name}'", *overrides)
        assert status == 0, output
    return folder


def video(folder: Path, monkeypatch: pytest.MonkeyPatch, *options: str) -> int:
    """What an earlier test measured is not in the way."""
    monkeypatch.chdir(folder)
    Path("video.json").unlink(missing_ok=True)
    fixed = ("run=run", "out=video.mp4", f"resolution={SIZE}", "frames_per_second=1")
    return main([*fixed, *options])


def decoded(file: Path) -> list[NDArray[np.uint8]]:
    with av.open(str(file)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def panel(frame: NDArray[np.uint8], column: int) -> NDArray[np.uint8]:
    """[SIZE, SIZE, 3]: the middle of every enlarged pixel of one picture."""
    left = LEFT + column * (SIZE * FACTOR + GAP)
    side = slice(FACTOR // 2, SIZE * FACTOR, FACTOR)
    return frame[TOP:, left:][side, side]


def psnr(picture: NDArray[np.uint8], expected: NDArray[np.uint8]) -> float:
    error = (picture.astype(float) - expected.astype(float)) / 255
    return -10 * log10((error**2).mean())


def test_frames_are_the_pictures_of_the_render_command(trained: Path) -> None:
    """Ten frames along the hard frames are these, which training has written, too."""
    options = ("run=run", "path=hard_frames", "seconds=10", "frames_per_second=1")
    status, output = run_module("ngi", "video", *options, f"resolution={SIZE}", folder=trained)
    assert status == 0, output
    assert "run/video_hard_frames.mp4: 10 frames; step 12" in output
    assert "needs a reference" in output
    frames = decoded(trained / "run" / "video_hard_frames.mp4")
    assert len(frames) == 10
    pictures = [
        np.asarray(Image.open(trained / "run" / "pictures" / f"hard_{i:02}_prediction.png"))
        for i in range(10)
    ]
    for index, frame in enumerate(frames):
        shown = panel(frame, 0)
        assert psnr(shown, pictures[index]) > 35
        assert psnr(shown, pictures[(index + 1) % 10]) < 30
    film = json.loads((trained / "run" / "video_hard_frames.json").read_text())
    assert film["measured"] == {}
    assert film["runs"] == [{"folder": ".", "label": "network", "step": 12}]
    assert not list(trained.rglob("*.partial"))


def test_the_file_is_what_browsers_play(trained: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ("out=short.mp4", "seconds=1.5", "frames_per_second=8", "resolution=271")
    assert video(trained, monkeypatch, *options) == 0
    with av.open("short.mp4") as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.frames, stream.average_rate) == (12, 8)
        # 295 x 321 with margins and label: odd, so both grow by one.
        assert (stream.width, stream.height) == (2 * LEFT + 271 + 1, TOP + 271 + GAP + 1)
    content = Path("short.mp4").read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")  # starts before all of it is there


def test_a_webp_file_is_the_same_film_over_and_over(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert video(trained, monkeypatch, "seconds=3") == 0
    monkeypatch.setattr("ngi.view.mp4.pyav", lambda: pytest.fail("PyAV is not needed"))
    assert video(trained, monkeypatch, "out=film.webp", "seconds=3") == 0
    with Image.open("film.webp") as film:
        assert (film.n_frames, film.info["loop"]) == (3, 0)
        for number, frame in enumerate(decoded(Path("video.mp4"))):
            film.seek(number)
            shown = np.asarray(film.convert("RGB"), dtype=float)
            assert film.info["duration"] == 1000
            assert abs(shown - frame[: shown.shape[0], : shown.shape[1]]).mean() < 4
    assert not list(trained.rglob("*.partial"))


def test_run_reference_and_other_run_stand_side_by_side(
    trained: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(trained / "two.json").write_text("[[0, 0.5, 1], [1, 0.5, 0.25]]")
    options = ("beside=method=other", "reference=1024", "seconds=5", "path=two.json")
    assert video(trained, monkeypatch, *options) == 0
    table = capsys.readouterr().out
    frames = decoded(trained / "video.mp4")
    for frame, v in ((frames[0], "[0,0.5,1]"), (frames[-1], "[1,0.5,0.25]")):
        for column, folder in ((0, "run"), (2, "method=other")):
            assert psnr(panel(frame, column), rendered(trained, folder, v, "a.png")) > 35
        reference = rendered(trained, "plain", v, "a_reference.png", "reference=1")
        assert psnr(panel(frame, 1), reference) > 30
    result = json.loads((trained / "video.json").read_text())
    assert [(entry["label"], entry["step"]) for entry in result["runs"]] == [
        ("run", 12),
        ("other", 12),
    ]
    assert result["measure"] == "temporal_error"
    assert list(result["measured"]) == ["run", "other", film.FLOOR]
    assert result["options"]["reference"] == 1024
    assert "commit" in result
    for label, measured in result["measured"].items():
        assert f"| {label}" in table
        assert f"{measured['srgb']:.3g}" in table
    # Both networks have hardly learnt anything: their error is far above the reference's noise.
    assert all(
        result["measured"][label]["relative"] > 3 * result["measured"][film.FLOOR]["relative"]
        for label in ("run", "other")
    )


def rendered(trained: Path, folder: str, v: str, name: str, *options: str) -> NDArray[np.uint8]:
    from ngi.view.picture import main as render

    given = (f"run={folder}", f"v={v}", f"resolution={SIZE}", "out=a.png", *options)
    assert render(given) == 0
    return np.asarray(Image.open(trained / name))


def test_a_network_does_not_flicker_and_a_path_tracer_does(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = {}
    for samples in (64, 256):
        options = ("path=static", "hard_frame=3", "seconds=6", f"reference={samples}")
        assert video(trained, monkeypatch, *options) == 0
        result = json.loads((trained / "video.json").read_text())
        assert result["measure"] == "flicker"
        network, tracer = result["measured"].values()
        assert network == {"srgb": 0, "relative": 0}
        found[samples] = tracer["relative"]
        # 2/√π σ of radiance L + ε, with a standard deviation of σ L.
        assert tracer["relative"] == pytest.approx(1.128 * NOISE / samples**0.5, rel=0.1)
    assert found[64] == pytest.approx(2 * found[256], rel=0.05)
    first, *others = decoded(trained / "video.mp4")
    assert all(psnr(panel(frame, 0), panel(first, 0)) > 45 for frame in others)


def test_path_tracing_flickers_with_the_noise_of_its_samples(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("beside=paths", "path=static", "hard_frame=3", "seconds=6")
    assert video(trained, monkeypatch, *options) == 0
    measured = json.loads((trained / "video.json").read_text())["measured"]
    assert measured["run"]["relative"] == 0
    assert measured["paths"]["relative"] == pytest.approx(1.128 * NOISE / 8**0.5, rel=0.1)


def test_pixels_that_a_path_made_nan_come_from_the_other_half(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ngi.render import AnalyticRenderer

    clean = AnalyticRenderer.render_image
    seeds = []

    def broken(self: AnalyticRenderer, *arguments: object, seed: int, **more: object) -> object:
        seeds.append(seed)
        image = clean(self, *arguments, seed=seed, **more)  # type: ignore[arg-type]
        image[seed % 2, 0, 0] = torch.nan
        return image

    monkeypatch.setattr(AnalyticRenderer, "render_image", broken)
    assert video(trained, monkeypatch, "reference=2", "seconds=3") == 0
    measured = json.loads((trained / "video.json").read_text())["measured"]
    assert all(np.isfinite(list(values.values())).all() for values in measured.values())
    assert len(set(seeds)) == 6  # of three frames with two halves


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("run=elsewhere",), "elsewhere/settings.json: no such file"),
        (("beside=elsewhere",), "elsewhere/settings.json: no such file"),
        (("beside=plain",), "beside: plain was trained on another scene"),
        (("beside=[method=other,run]",), "beside: run is given twice"),
        (("beside=started",), "result.json: no such file; the run is not finished yet"),
        (("beside=hostile",), "path_tracing.denoiser._target_ is 'os.system'"),
        (("beside=3",), "3/settings.json: no such file"),
        (("path=zigzag",), "path: 'zigzag' is neither camera, hard_frames, static nor a file"),
        (("path=short.txt",), "path: short.txt[1]: [0.5, 0.5]; expected 3 numbers from 0 to 1"),
        (("path=outside.txt",), "path: outside.txt[0]: [0, 2, 0]; expected 3 numbers"),
        (("path=words.txt",), "path: words.txt[0]: ['a', 'b', 'c']; expected 3 numbers"),
        (("path=number.txt",), "path: number.txt holds no list of v"),
        (("path=broken.txt",), "path: broken.txt is not a JSON file"),
        (("path=static", "hard_frame=10"), "hard_frame: 10; there are 0 to 9"),
        (("out=video.avi",), "out: 'video.avi' does not end with .mp4 or .webp"),
        (("out=nowhere/video.mp4",), "the folder nowhere does not exist"),
        (("resolution=0",), "at least 1"),
        (("frames_per_second=0",), "at least 1"),
        (("reference=7",), "reference: 7; it has to be an even number"),
        (("seconds=1",), "seconds: 1.0; a video needs at least two frames"),
        (("seconds=nan",), "seconds: nan"),
        (("seconds=inf",), "seconds: inf"),
        (("out=run/settings.mp4",), "run/settings.json, the file for the measurements, exists"),
        (("path=tour.json", "out=tour.mp4"), "out: tour.json, the file for the measurements"),
    ],
)
def test_mistakes_are_named(
    trained: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    message: str,
) -> None:
    for name, content in (
        ("short", "[[0, 0, 0], [0.5, 0.5]]"),
        ("outside", "[[0, 2, 0]]"),
        ("words", '[["a", "b", "c"]]'),
        ("number", "3"),
        ("broken", "[[0, 0, 0]"),
    ):
        (trained / f"{name}.txt").write_text(content)
    (trained / "tour.json").write_text("[[0, 0, 0], [1, 1, 1]]")
    settings = json.loads((trained / "paths" / "settings.json").read_text())
    for name, denoiser in (("started", None), ("hostile", {"_target_": "os.system"})):
        (trained / name).mkdir(exist_ok=True)
        settings["path_tracing"]["denoiser"] = denoiser
        (trained / name / "settings.json").write_text(json.dumps(settings))
    (trained / "hostile" / "result.json").write_text("{}")
    assert video(trained, monkeypatch, f"out={tmp_path / 'wrong.mp4'}", *options) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_another_frame_is_another_file_and_path_tracing_is_no_network(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(trained)
    still = ("run=paths", "path=static", "seconds=2", "frames_per_second=1", f"resolution={SIZE}")
    for frame in (0, 3, 3):
        assert main([*still, f"hard_frame={frame}"]) == 0
    assert main([*still, "hard_frame=3", "supersampled_edges=true"]) == 0
    files = sorted(file.name for file in (trained / "paths").glob("video_*.json"))
    assert files == ["video_static.json", "video_static_3.json", "video_static_3_supersampled.json"]
    for file in files:
        (run,) = json.loads((trained / "paths" / file).read_text())["runs"]
        assert run["label"] == "path tracing"


def test_a_missing_extra_is_named_before_anything_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    assert video(tmp_path, monkeypatch) == 2
    assert install_command("video") in capsys.readouterr().err


def test_interrupted_work_leaves_no_file(trained: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = []

    def interrupted(*arguments: object) -> object:
        shown.append(arguments)
        if len(shown) == 90:  # the codec looks ahead, and writes nothing at first
            assert list(trained.glob("cut.mp4.partial"))
            raise KeyboardInterrupt
        return side_by_side(*arguments)

    side_by_side = film.side_by_side
    monkeypatch.setattr(film, "side_by_side", interrupted)
    assert video(trained, monkeypatch, "out=cut.mp4", "seconds=100") == 130
    assert len(shown) == 90
    assert not list(trained.glob("cut*"))
