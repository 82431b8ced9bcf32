"""Linear pictures are what was measured, and give the metrics again."""

from __future__ import annotations

import json
import logging
import math
from pathlib import Path

import numpy as np
import pytest
import torch

from ngi.commands.metrics import main
from ngi.evaluate import Evaluation, Evaluator, Lpips, ReferenceCache
from ngi.evaluate.linear import read_linear
from ngi.files.durable import DamagedError
from ngi.machine.backend import a_worker_thread, activate, mi
from ngi.render.exr import read_exr, write_exr
from ngi.train import train
from tests.learn.command_line import SMALL
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED

STRANGE = torch.tensor([[torch.nan, -3.0, torch.inf], [1e-9, 0.1, 65504.0]])


def picture() -> torch.Tensor:
    """[2, 40, 3] of radiance between 0 and 100, with values that few formats keep."""
    values = 100 * torch.rand(2, 40, 3, generator=torch.Generator().manual_seed(0))
    values[:, 0] = STRANGE
    return values


def test_32_bit_files_are_the_picture_bit_for_bit(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", picture())
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").numpy(), picture().numpy())


def test_16_bit_files_are_numpys_half_floats(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", picture(), half=True)
    expected = picture().numpy().astype(np.float16).astype(np.float32)
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr").numpy(), expected)
    write_exr(tmp_path / "b.exr", picture())
    assert (tmp_path / "a.exr").stat().st_size < 0.7 * (tmp_path / "b.exr").stat().st_size


def test_what_16_bits_cannot_hold_stays_as_it_is(tmp_path: Path) -> None:
    bright = torch.full((4, 4, 3), 1e5)
    write_exr(tmp_path / "a.exr", bright, half=True)
    assert torch.equal(read_exr(tmp_path / "a.exr"), bright)


@pytest.mark.parametrize("problem", ["cut short", "gone", "grey"])
def test_a_bad_file_is_named(tmp_path: Path, problem: str) -> None:
    file = tmp_path / "a.exr"
    if problem == "grey":
        activate("scalar")
        with a_worker_thread():
            mi.Bitmap(np.ones((4, 4), np.float32)).write(str(file))
    elif problem == "cut short":
        write_exr(file, picture())
        file.write_bytes(file.read_bytes()[:500])
    with pytest.raises(DamagedError, match=r"a\.exr (cannot be read|is no RGB image)"):
        read_exr(file)


@pytest.fixture
def evaluation(renderer, protocol, tmp_path: Path) -> Evaluation:
    """Of a prediction that is off by a fifth, and NaN in one pixel of the uniform set."""
    evaluator = Evaluator(
        renderer=renderer,
        test_inputs=lambda v, buffers: (v,),  # noqa: ARG005
        protocol=protocol,
        cache=ReferenceCache(tmp_path / "cache"),
        lpips=Lpips(weights=None),
    )

    def predict(buffers: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
        radiance = 1.2 * renderer.truth(v, len(buffers))
        if torch.allclose(v, evaluator._frames[-1].scene_vector):
            radiance[3, 4, 0] = torch.nan
        return torch.log1p(radiance)

    return evaluator.evaluate(predict)


FRAMES = 14
"""Ten hard ones and four others, of 33 x 33 pixels."""
MEGABYTES = FRAMES * 2 * 33 * 33 * 3 * 4e-6


@pytest.mark.parametrize(
    ("room", "kept"), [(1.0, "float"), (0.99, "half"), (0.5, "half"), (0.49, None), (0.0, None)]
)
def test_as_much_is_kept_as_there_is_room_for(
    tmp_path: Path, evaluation: Evaluation, room: float, kept: str | None, caplog
) -> None:
    folder = tmp_path / "run" / "linear"
    folder.mkdir(parents=True)
    (folder / "hard_99_prediction.exr").touch()  # of an earlier evaluation
    with caplog.at_level(logging.WARNING):
        assert evaluation.write(folder.parent, linear_megabytes=room * MEGABYTES) == kept
    assert len(list(folder.glob("*.exr"))) == (2 * FRAMES if kept else 0)
    assert ("`ngi metrics` cannot check this run" in caplog.text) == (room == 0.49)
    if kept:
        prediction, reference = read_linear(folder, "hard", 3)
        tolerance = {"rtol": 1e-3 if kept == "half" else 0.0, "atol": 0.0}
        torch.testing.assert_close(prediction, evaluation.frames[3].prediction, **tolerance)
        torch.testing.assert_close(reference, evaluation.frames[3].reference.radiance, **tolerance)


@pytest.fixture
def run(tmp_path: Path, evaluation: Evaluation, protocol) -> Path:
    """The folder of a finished run, as far as its metrics are concerned."""
    folder = tmp_path / "run"
    folder.mkdir()
    kept = evaluation.write(folder, linear_megabytes=MEGABYTES)
    settings = {"_target_": "ngi.evaluate.EvaluationProtocol", **protocol.__dict__}
    content = {
        **evaluation.result(),
        "linear": kept,
        "config": {"evaluation": {"evaluator": {"protocol": settings}}},
    }
    (folder / "result.json").write_text(json.dumps(content))
    return folder


def change(run: Path, edit) -> None:
    file = run / "result.json"
    content = json.loads(file.read_text())
    edit(content)
    file.write_text(json.dumps(content))


def protocol_of_old(content: dict) -> None:
    content["config"]["evaluation"]["evaluator"]["protocol"]["forgotten"] = 3


def test_the_metrics_are_those_of_the_pictures(run: Path, evaluation: Evaluation, capsys) -> None:
    assert main([f"run={run.parent}"]) == 0
    shown = capsys.readouterr().out
    assert "all frames agree" in shown
    first = [
        read_exr(run / "linear" / f"hard_{index:02d}_{kind}.exr").double().numpy()
        for index in range(10)
        for kind in ("prediction", "reference")
    ]
    pairs = zip(first[::2], first[1::2], strict=True)
    mape = np.mean([np.mean(np.abs(p - r) / (r + 0.01)) for p, r in pairs])
    (row,) = [line.split() for line in shown.splitlines() if line.split()[:2] == ["hard", "mape"]]
    assert [float(value) for value in row[2:]] == pytest.approx([mape, mape], rel=1e-5)
    assert evaluation.result()["non_finite"]["uniform"] == 1, "NaN is compared, too"


def test_half_floats_agree_as_far_as_they_can(run: Path, evaluation: Evaluation, capsys) -> None:
    kept = evaluation.write(run, linear_megabytes=0.5 * MEGABYTES)
    change(run, lambda content: content.update(linear=kept))
    assert main([f"run={run}"]) == 0
    assert "half pictures" in capsys.readouterr().out


def test_a_changed_pixel_is_found(run: Path, capsys) -> None:
    file = run / "linear" / "uniform_01_reference.exr"
    pixels = read_exr(file)
    pixels[5, 6, 1] += 0.01
    write_exr(file, pixels)
    assert main([f"run={run}"]) == 1
    shown = capsys.readouterr().out
    assert "uniform frame 1: mape is" in shown
    assert "frame 2" not in shown
    assert "all frames agree" not in shown


def test_a_changed_number_is_found(run: Path, capsys) -> None:
    change(run, lambda content: content["metrics"]["hard"]["dssim"].update(mean=0.01))
    assert main([f"run={run}"]) == 1
    assert "hard: dssim's mean is 0.01 in result.json" in capsys.readouterr().out


def test_pixels_that_are_no_numbers_are_counted_exactly(run: Path, capsys) -> None:
    file = run / "linear" / "hard_02_prediction.exr"
    pixels = read_exr(file)
    pixels[:10, :20] = torch.nan
    write_exr(file, pixels)

    def one_more(content: dict) -> None:
        content["linear"] = "half"  # whose metrics may differ by a hundredth
        (frame,) = (f for f in content["frames"] if (f["set"], f["index"]) == ("hard", 2))
        frame.update(dict.fromkeys(("mape", "dssim", "mae", "lpips"), math.nan), non_finite=201)

    change(run, one_more)
    assert main([f"run={run}"]) == 1
    assert "hard frame 2: non_finite is 201 in result.json, recomputed 200" in (
        capsys.readouterr().out
    )


@pytest.mark.parametrize(
    ("problem", "message"),
    [
        ("none kept", "run has no linear pictures: run.linear_megabytes was too small"),
        ("packed", "run holds only the network of a run, without its pictures"),
        ("gone", "hard_02_prediction.exr cannot be read"),
        (
            "size",
            "02_prediction.exr and its reference have different sizes, 8 x 8 and 33 x 33",
        ),
        ("protocol", "in this version of the program the same settings give"),
        ("damaged", "result.json is damaged (JSONDecodeError: Expecting value"),
        ("older", "the same settings give no protocol; use the version that made the run"),
        ("list", "result.json is not a result of this program (AttributeError"),
        ("other", "result.json is not a result of this program (KeyError"),
        ("unreadable", "result.json is not a result of this program (IsADirectoryError"),
        ("folder", "holds no finished run"),
    ],
)
def test_what_cannot_be_checked_is_said(run: Path, problem: str, message: str, capsys) -> None:
    file = run / "linear" / "hard_02_prediction.exr"
    if problem == "none kept":
        change(run, lambda content: content.update(linear=None))
    elif problem == "packed":
        change(run, lambda content: [content.pop(key) for key in ("linear", "frames")])
    elif problem == "gone":
        file.unlink()
    elif problem == "size":
        write_exr(file, torch.zeros(8, 8, 3))
    elif problem == "damaged":
        (run / "result.json").write_text("")
    elif problem == "protocol":
        change(run, lambda content: content["protocol"].update(identity="0123"))
    elif problem == "older":
        change(run, protocol_of_old)
    elif problem in ("list", "other"):
        (run / "result.json").write_text({"list": "[]", "other": '{"linear": "float"}'}[problem])
    else:
        (run / "result.json").unlink()
        if problem == "unreadable":
            (run / "result.json").mkdir()
    assert main([f"run={run}"]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("method", ["uniform", "path_tracing_8spp"])
def test_a_run_keeps_them(tmp_path: Path, method: str, capsys) -> None:
    places = (f"run.folder={tmp_path / 'run'}", f"run.references={tmp_path / 'references'}")
    sizes = ("resolution.start=32", "run.linear_megabytes=10")
    result = train(run_config(*SMALL, f"method={method}", *places, *sizes))
    assert result["linear"] == "float"
    assert main([f"run={tmp_path / 'run'}"]) == 0
    assert "all frames agree" in capsys.readouterr().out
    change(tmp_path / "run", lambda content: content["frames"][0].update(mape=0.5))
    assert main([f"run={tmp_path / 'run'}"]) == 1
