"""`ngi render` on runs of closed formulas, as a user starts it."""

import contextlib
import io
import json
import shutil
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.evaluate.pictures import eight_bit
from ngi.render import AnalyticRenderer
from ngi.render.exr import read_exr, write_exr
from ngi.view.picture import main
from ngi.view.screen import CURVES, shown
from ngi.view.trained_run import TrainedRun
from tests.learn.command_line import run, run_module

RUN = "run.folder=run"


def render(folder: Path, *options: str) -> tuple[int, str]:
    """Exit status and everything printed; in this process, which spares its imports."""
    printed = io.StringIO()
    with contextlib.chdir(folder), redirect_stdout(printed), redirect_stderr(printed):
        try:
            status = main(["run=run", *options])
        except SystemExit as ended:
            status = int(ended.code or 0)
    return status, printed.getvalue()


def render_as_users_do(folder: Path, *options: str) -> tuple[int, str]:
    return run_module("ngi", "render", "run=run", *options, folder=folder)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trained")
    status, output = run(folder, RUN)
    assert status == 0, output
    return folder


def test_the_picture_is_the_one_that_training_wrote(trained: Path) -> None:
    status, output = render_as_users_do(trained, "hard_frame=3", "resolution=48", "out=three.png")
    assert status == 0, output
    assert "step 12" in output
    expected = Image.open(trained / "run" / "pictures" / "hard_03_prediction.png")
    np.testing.assert_array_equal(np.asarray(Image.open(trained / "three.png")), expected)
    assert not list(trained.glob("*.log"))


def test_a_reference_beside_it_and_the_metrics(trained: Path) -> None:
    status, output = render(trained, "reference=4", "resolution=48", "out=zero.png")
    assert status == 0, output
    written = json.loads((trained / "run" / "result.json").read_text())["frames"][0]
    assert f"mape {written['mape']:.4g}" in output  # closed formulas have no noise
    assert "zero_reference.png, zero_error.png\n" in output
    for kind in ("reference", "error"):
        expected = Image.open(trained / "run" / "pictures" / f"hard_00_{kind}.png")
        np.testing.assert_array_equal(
            np.asarray(Image.open(trained / f"zero_{kind}.png")), expected
        )


def test_pixels_that_a_path_made_nan_are_traced_again(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(renderer: AnalyticRenderer, *arguments: object, seed: int, **options: int) -> object:
        image = usual(renderer, *arguments, seed=seed, **options)
        image[seed, seed, 0] = torch.nan
        return image

    usual = AnalyticRenderer.render_image
    _, expected = render(trained, "reference=4", "resolution=48", "out=whole.png")
    monkeypatch.setattr(AnalyticRenderer, "render_image", broken)
    status, output = render(trained, "reference=4", "resolution=48", "out=mended.png")
    assert status == 0, output
    assert output.splitlines()[2:] == expected.splitlines()[2:]  # closed formulas have no noise


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_is_named_and_leaves_the_error_map_that_was_there(trained: Path) -> None:
    (trained / "full_error.png").write_bytes(b"earlier")
    (trained / "full_error.png.partial").symlink_to("/dev/full")
    status, output = render(trained, "reference=4", "resolution=48", "out=full.png")
    assert status == 2
    assert "full_error.png" in output
    assert "Free disk space" in output
    assert (trained / "full_error.png").read_bytes() == b"earlier"


def test_v_may_be_given(trained: Path) -> None:
    network = TrainedRun.open(trained / "run")
    status, output = render(trained, "v=[0.2,0.5,0.9]", "resolution=32", "out=given.exr")
    assert status == 0, output
    expected = network.radiance(torch.tensor([0.2, 0.5, 0.9]), resolution=32)
    assert torch.equal(read_exr(trained / "given.exr"), expected)


@pytest.mark.parametrize("curve", CURVES)
def test_png_files_are_as_the_viewer_shows_them(trained: Path, curve: str) -> None:
    asked = (f"tone_mapping={curve}", "exposure=1", "resolution=48", "reference=4")
    for kind in ("png", "exr"):
        status, output = render(trained, *asked, f"out={curve}.{kind}")
        assert status == 0, output
    for name in (curve, f"{curve}_reference"):
        radiance = read_exr(trained / f"{name}.exr")
        np.testing.assert_array_equal(
            np.asarray(Image.open(trained / f"{name}.png")),
            eight_bit(shown(radiance, curve=curve, exposure=1.0)),
        )


def test_exr_files_hold_linear_radiance(tmp_path: Path) -> None:
    from ngi.machine.backend import a_worker_thread, mi

    radiance = torch.rand(5, 7, 3, generator=torch.Generator().manual_seed(0)) * 100 - 1
    write_exr(tmp_path / "a.exr", radiance)
    with a_worker_thread():
        written = np.array(mi.Bitmap(str(tmp_path / "a.exr")))
    np.testing.assert_array_equal(written, radiance)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("run=elsewhere",), "elsewhere/settings.json: no such file"),
        (("v=[0.5,2,0]",), "expected 3 numbers from 0 to 1"),
        (("v=[0.5]",), "expected 3 numbers from 0 to 1"),
        (("hard_frame=10",), "there are 0 to 9"),
        (("out=picture.jpg",), ".png"),
        (("out=nowhere/picture.png",), "the folder nowhere does not exist"),
        (("resolution=0",), "at least 1"),
        (("resolution=31", "reference=4"), "resolution: 31: the metrics"),
        (("resolution=many",), "'resolution=many' is wrong: input should be a valid integer"),
        (("reference=64:",), "'reference=64:' is wrong: input should be a valid integer"),
        (("v=[0.5,",), "'v=[0.5,' is wrong: input should be a valid number"),
        (("colour=red",), "'colour' is no option"),
        (("tone_mapping=pink",), "tone_mapping: 'pink': choose one of sRGB"),
    ],
)
def test_mistakes_are_named(trained: Path, options: tuple[str, ...], message: str) -> None:
    status, output = render(trained, *options)
    assert status == 2
    assert message in output
    assert "Traceback" not in output


def test_weights_of_lpips_that_are_missing_are_named_before_anything_is_rendered(
    trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NGI_LPIPS_WEIGHTS", "nowhere.pth")
    status, output = render(trained, "reference=4", "resolution=48", "out=early.png")
    assert status == 2
    assert "nowhere.pth" in output
    assert not (trained / "early.png").exists()
    status, output = render(trained, "resolution=48", "out=early.png")
    assert status == 0, output  # which needs no LPIPS


def test_a_damaged_checkpoint_gives_way_to_the_one_before_which_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    status, output = run(tmp_path, RUN, "run.checkpoint_steps=4")
    assert status == 0, output
    newest = tmp_path / "run" / "last.ckpt"
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 1
    newest.write_bytes(content)
    status, output = render(tmp_path)
    assert status == 0, output
    assert "step 8" in output
    assert "last.ckpt is damaged" in caplog.text
    assert "using the previous checkpoint" in caplog.text
    (tmp_path / "run" / "previous.ckpt").unlink()
    status, output = render(tmp_path)
    assert status == 2
    assert "last.ckpt is damaged" in output
    newest.unlink()
    status, output = render(tmp_path)
    assert status == 2
    assert "no checkpoint yet" in output


def test_a_scene_that_changed_or_is_unknown_is_refused(trained: Path, tmp_path: Path) -> None:
    settings = json.loads((trained / "run" / "settings.json").read_text())
    for scene, renderer, message in (
        ({"name": "analytic", "hash": "0"}, settings["renderer"], "an earlier version of"),
        (
            {"name": "my-lamp", "hash": "0"},
            {"_target_": "ngi.render.workers.mitsuba_renderer"},
            "scene 'my-lamp' is not found",
        ),
    ):
        folder = tmp_path / scene["name"]
        (folder / "run").mkdir(parents=True)
        (folder / "run" / "last.ckpt").write_bytes((trained / "run" / "last.ckpt").read_bytes())
        changed = {**settings, "scene": scene, "renderer": renderer}
        (folder / "run" / "settings.json").write_text(json.dumps(changed))
        status, output = render(folder)
        assert status == 2
        assert message in output


@pytest.mark.parametrize(
    ("group", "target"),
    [
        ("model", "os.system"),
        ("model", "ngi.train.os.system"),
        ("renderer", "subprocess.check_output"),
        ("renderer", "ngi.files.durable.write_atomically"),
    ],
)
def test_a_folder_of_somebody_else_executes_nothing(
    trained: Path, tmp_path: Path, group: str, target: str
) -> None:
    shutil.copytree(trained / "run", tmp_path / "run")
    path = tmp_path / "run" / "settings.json"
    settings = json.loads(path.read_text())
    command = "touch was_here"
    settings[group] = {"_target_": target, "command": command, "args": command, "path": "was_here"}
    path.write_text(json.dumps(settings))
    status, output = render(tmp_path)
    assert status == 2
    assert f"{group}._target_ is '{target}'" in output
    assert not (tmp_path / "was_here").exists()
