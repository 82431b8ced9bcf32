"""Runs of `method=path_tracing…` on closed formulas."""

import csv
import json
import re
import shutil
from collections.abc import Callable
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hydra.errors import InstantiationException
from torch import Tensor, nn

from analysis.doubts import comparison_warnings
from analysis.frame_times import frame_table
from analysis.methods import name_methods
from analysis.report_files import write_report
from analysis.runs import find_runs
from ngi.methods.path_tracing.frame_time import show
from ngi.render import AnalyticRenderer
from ngi.train import train
from ngi.view.trained_run import TrainedRun
from tests.learn.command_line import SMALL
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED

pytestmark = IGNORED

REFERENCE_SAMPLES = 32


def run(folder: Path, name: str, *overrides: str) -> dict:
    """The result of a run in `folder / name`."""
    places = (f"run.folder={folder / name}", f"run.references={folder / 'references'}")
    return train(run_config(*SMALL, "+renderer.noise=1.0", *places, *overrides))


def result(folder: Path, name: str) -> dict:
    return json.loads((folder / name / "result.json").read_text())


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A network that was trained for 12 steps, and path tracing at 8 and at 128 samples."""
    folder = tmp_path_factory.mktemp("runs")
    run(folder, "network", "method=uniform", "resolution.start=32")
    for name, samples in (("few", 8), ("again", 8), ("more", 128)):
        options = ("method=path_tracing_8spp", f"path_tracing.samples_per_pixel={samples}")
        run(folder, name, *options)
    return folder


def test_it_is_measured_on_the_same_frames_by_the_same_references(runs: Path) -> None:
    network, few = (result(runs, name) for name in ("network", "few"))
    for key in ("reference_hash", "scene_hash", "protocol"):
        assert few[key] == network[key]
    assert [f["index"] for f in few["frames"]] == [f["index"] for f in network["frames"]]
    assert network.keys() - few.keys() <= {
        *("energy_joules", "energy_sources", "wall_seconds_by_phase", "non_finite_losses"),
        *("generated_batches", "scored_batches", "patches_repaired", "patches_masked"),
        *("batches_refused", "steps_refused", "steps_scaled", "new_worst_share"),
    }
    assert few["steps"] == few["paths_traced"] == few["run_seconds"] == 0
    assert few["label"]["method"] == "path_tracing_8spp"
    assert few["label"]["sampler"] == few["label"]["model"] == "none"
    pictures = {path.name for path in (runs / "few" / "pictures").iterdir()}
    assert pictures == {path.name for path in (runs / "network" / "pictures").iterdir()}


def test_the_noise_is_the_error(runs: Path) -> None:
    """Mean |error| of normal noise is √(2/π) σ, σ² = 1/samples + 1/samples of the reference."""
    for name, samples in (("few", 8), ("more", 128)):
        found = result(runs, name)["metrics"]["hard"]["mape"]["mean"]
        expected = (2 / pi * (1 / samples + 1 / REFERENCE_SAMPLES)) ** 0.5
        assert found == pytest.approx(expected, rel=0.1)


def test_the_same_seed_gives_the_same_result(runs: Path) -> None:
    assert result(runs, "few")["frames"] == result(runs, "again")["frames"]


def test_a_frame_is_timed_in_its_parts(runs: Path) -> None:
    frame = result(runs, "few")["frame"]
    assert frame["samples_per_pixel"] == 8
    ms = frame["milliseconds"]
    assert ms["path tracing"] == pytest.approx(ms["paths"])  # no denoiser, no buffers
    assert ms["network"] == pytest.approx(ms["buffers"] + ms["network alone"])
    assert all(value >= 0 for value in ms.values())


@pytest.mark.parametrize(("milliseconds", "samples"), [("null", 12), ("12_500", 6)])
def test_denoised_frames_are_timed_with_the_buffers_that_guide_them_and_fill_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, milliseconds: str, samples: int
) -> None:
    """Buffers take 2 s, a sample of all pixels 1 s, the denoiser 4 s, the network alone 16 s."""
    now = [0.0]

    def taking(function: Callable[..., Any], seconds: float) -> Callable[..., Any]:
        def slow(*arguments: Any, **options: Any) -> Any:
            now[0] += seconds * options.get("samples_per_pixel", 1)
            return function(*arguments, **options)

        return slow

    clock = SimpleNamespace(perf_counter=lambda: now[0])
    monkeypatch.setattr("ngi.machine.timing.time", clock)
    for name, seconds in (("image_buffers", 2.0), ("render_image", 1.0)):
        slow = taking(getattr(AnalyticRenderer, name), seconds)
        monkeypatch.setattr(AnalyticRenderer, name, slow)
    monkeypatch.setattr("ngi.methods.path_tracing.run.show", taking(show, 16.0))
    keep = taking(lambda radiance, *_: radiance, 4.0)
    monkeypatch.setattr("ngi.denoise.OpenImageDenoise", lambda **_: keep)
    time = f"path_tracing.milliseconds={milliseconds}"
    frame = run(tmp_path, "run", "method=path_tracing_oidn", time)["frame"]
    assert frame["samples_per_pixel"] == samples
    assert frame["milliseconds"] == {
        "buffers": 2000,
        "paths": 1000 * samples,
        "denoiser": 4000,
        "network alone": 16_000,
        "path tracing": 2000 + 1000 * samples + 4000,
        "network": 18_000,
    }


def test_the_network_beside_it_is_the_one_that_would_be_trained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here without the first component of v, which the renderer says places the camera."""
    given = []

    def seen(network: nn.Module, buffers: Tensor, v: Tensor, **how: Any) -> Tensor:
        given.append(v)
        return show(network, buffers, v, **how)

    monkeypatch.setattr(AnalyticRenderer, "camera_part", slice(0, 1), raising=False)
    monkeypatch.setattr("ngi.methods.path_tracing.run.show", seen)
    options = ("method=path_tracing_8spp", "data=patches_without_camera", "renderer.dimensions=3")
    run(tmp_path, "run", *options)
    frames = AnalyticRenderer(dimensions=3, patch_size=16).hard_frames()
    assert {tuple(v.tolist()) for v in given} == {tuple(v[1:].tolist()) for v in frames}


def test_a_finished_run_is_not_made_again_and_an_unfinished_one_is(runs: Path) -> None:
    file = runs / "again" / "result.json"
    before = file.read_bytes()
    assert run(runs, "again", "method=path_tracing_8spp") == json.loads(before)
    assert file.read_bytes() == before
    file.unlink()
    (runs / "again" / "steps.csv").write_text("step\n1\n")  # of a training that died at once
    (runs / "again" / "metrics.csv").write_text("step,other\n0,1\n")
    assert run(runs, "again", "method=path_tracing_8spp")["frames"] == json.loads(before)["frames"]
    rows = csv.DictReader((runs / "again" / "metrics.csv").read_text().splitlines())
    (row,) = rows
    assert row["step"] == "0"
    assert float(row["hard_mape"]) > 0
    assert not (runs / "again" / "steps.csv").exists()


def test_it_stands_in_the_report_beside_trained_networks(runs: Path, tmp_path: Path) -> None:
    for name in ("network", "few"):
        shutil.copytree(  # without the chains of 12 steps, too few for their figure
            runs / name, tmp_path / "runs" / name, ignore=shutil.ignore_patterns("chains.bin")
        )
    report = write_report(tmp_path / "runs", tmp_path / "report")
    assert "path tracing, 8 spp" in report.text
    assert "Time per frame" in report.text
    found = name_methods(find_runs(tmp_path / "runs")[0])
    assert not [warning for warning in comparison_warnings(found) if "the same time" in warning]
    (row,) = frame_table(found).rows
    assert [cell.text for cell in row[1:3]] == ["path tracing, 8 spp", "8"]


def test_there_is_no_network_to_open(runs: Path) -> None:
    with pytest.raises(ValueError, match="few has no network"):
        TrainedRun.open(runs / "few")


def test_the_model_clock_needs_no_costs_where_nothing_is_trained(tmp_path: Path) -> None:
    options = ("budget.clock=model", f"budget.costs={tmp_path / 'costs.json'}")
    found = run(tmp_path, "run", "method=path_tracing_8spp", *options)
    assert (found["clock"], found["run_seconds"]) == ("model", 0)


def test_as_many_samples_as_a_time_allows(tmp_path: Path) -> None:
    """Closed formulas cost the same at any number of samples: all fit into an hour."""
    for milliseconds, samples in ((3_600_000, range(2**16, 2**17)), (0.001, range(1, 2))):
        time = f"path_tracing.milliseconds={milliseconds}"
        found = run(tmp_path, f"within_{milliseconds}", "method=path_tracing", time)
        assert found["frame"]["samples_per_pixel"] in samples


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("path_tracing.samples_per_pixel=0",), "path_tracing.samples_per_pixel is 0"),
        (("path_tracing.samples_per_pixel=many",), "path_tracing.samples_per_pixel: 'many'"),
        (("path_tracing.milliseconds=-1",), "path_tracing.milliseconds is -1"),
        (("path_tracing.milliseconds=10", "path_tracing.samples_per_pixel=4"), "give one of them"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    with pytest.raises((ValueError, InstantiationException), match=re.escape(message)):
        run(tmp_path, "run", "method=path_tracing", *options)
    assert not list(tmp_path.rglob("result.json"))
