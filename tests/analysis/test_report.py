import math
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from PIL import Image
from scipy import stats

from analysis import plots
from analysis.curves import error_curve
from analysis.methods import name_methods
from analysis.plots import COLOURS, FORMATS, method_styles
from analysis.report import main
from analysis.runs import FURTHER, Run, find_runs
from analysis.tables import TITLES

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def quick_page(monkeypatch) -> None:
    """The page has tests of its own (test_page.py); its figures take a second per scene."""
    monkeypatch.setattr(
        "analysis.report_files.write_page", lambda _contents, file, _progress: file.touch()
    )


@pytest.fixture
def one_scene(make_run, tmp_path) -> Path:
    for seed in range(2):
        make_run(seed=seed)
        make_run(seed=seed, sampler="mcmc_loss_step", quality=1.3)
    return tmp_path / "runs"


@pytest.fixture
def two_scenes(one_scene, make_run) -> Path:
    for seed in range(2):
        make_run(scene="sphere-caustic", seed=seed)
        make_run(scene="sphere-caustic", seed=seed, sampler="mcmc_loss_step", quality=1.3)
    return one_scene


def test_report_writes_everything_it_names(two_scenes, capsys) -> None:
    settings = dict(matplotlib.rcParams)
    assert main([str(two_scenes)]) == 0
    assert dict(matplotlib.rcParams) == settings
    output = capsys.readouterr()
    assert output.err == ""
    report = two_scenes / "report"
    named = [Path(line.strip()) for line in output.out.split("Written:")[1].splitlines() if line]
    expected = {"results.csv", "results.md", "results.tex", "mirror.png", "sphere-caustic.png"}
    expected |= {"index.html", "provenance.csv"}
    expected |= {f"error_{s}.{x}" for s in ("mirror", "sphere-caustic") for x in FORMATS}
    assert {file.name for file in named if file.is_file()} == expected
    assert all(file.exists() for file in named)
    assert max(map(len, output.out.split("Protocol")[0].splitlines())) <= 120
    assert len(pd.read_csv(report / "results.csv")) == 2 * 3
    ElementTree.parse(report / "error_mirror.svg")


def test_what_else_all_runs_of_a_scene_have_is_drawn(two_scenes) -> None:
    columns = [f"{name}_{metric}" for name in ("hard", "uniform") for metric in FURTHER]
    for number, file in enumerate(sorted(two_scenes.rglob("metrics.csv"))):
        if file.is_relative_to(two_scenes / "mirror") or number % 2:
            table = pd.read_csv(file)
            for column in columns:
                table[column] = 0.01 / (1 + table["step"])
            table.to_csv(file, index=False)
    assert main([str(two_scenes)]) == 0
    drawn = {
        scene: (two_scenes / "report" / f"error_{scene}.svg").read_text()
        for scene in ("mirror", "sphere-caustic")
    }
    for metric in FURTHER:
        assert drawn["mirror"].count(TITLES[metric]) == 2
        assert TITLES[metric] not in drawn["sphere-caustic"]
    assert drawn["sphere-caustic"].count("LPIPS") == 2


@pytest.mark.usefixtures("undrawn")
def test_comparison_sheets_show_reference_and_both_methods(one_scene, tmp_path) -> None:
    assert main([str(one_scene), "--output", str(tmp_path / "out")]) == 0
    pictures = tmp_path / "out" / "pictures"
    frames = sorted(file.name for file in (pictures / "mirror").iterdir())
    assert frames == [f"hard_{index:02d}.png" for index in range(5)]
    with Image.open(pictures / "mirror" / "hard_02.png") as sheet:
        width, height = sheet.size
        pixels = np.asarray(sheet.convert("RGB"))
    assert width == 12 + 5 * (256 + 12)  # reference, two predictions, two error maps
    source = one_scene / "mirror" / "uniform" / "seed=0" / "pictures" / "hard_02_reference.png"
    with Image.open(source) as reference:
        enlarged = np.asarray(reference).repeat(8, axis=0).repeat(8, axis=1)
    assert np.array_equal(pixels[32 : 32 + 256, 12 : 12 + 256], enlarged)
    with Image.open(pictures / "mirror.png") as overview:
        # The third of the sheet is a row; the legend comes once.
        assert overview.size == (width, 3 * (256 + 32) + height - (256 + 32))


@pytest.mark.usefixtures("undrawn")
def test_overview_shows_where_methods_differ_most(one_scene, tmp_path) -> None:
    assert main([str(one_scene), "--output", str(tmp_path)]) == 0
    with Image.open(tmp_path / "pictures" / "mirror.png") as overview:
        first = np.asarray(overview.crop((0, 0, overview.width, 256 + 32)))
    with Image.open(tmp_path / "pictures" / "mirror" / "hard_03.png") as sheet:
        expected = np.asarray(sheet.crop((0, 0, sheet.width, 256 + 32)))
    assert np.array_equal(first, expected)  # the fixture's frame 3 has the largest spread


@pytest.mark.usefixtures("undrawn")
def test_errors_that_are_not_finite_do_not_hide_where_methods_differ(make_run, tmp_path) -> None:
    def diverge(result: dict) -> None:
        for frame in result["frames"]:
            if frame["index"] in (0, 1):
                frame["mape"] = float("nan")

    make_run(change=diverge)
    make_run(sampler="mcmc_loss")
    make_run(sampler="mcmc_loss_step", quality=1.3)
    assert main([str(tmp_path / "runs"), "--output", str(tmp_path)]) == 0
    with Image.open(tmp_path / "pictures" / "mirror.png") as overview:
        first = np.asarray(overview.crop((0, 0, overview.width, 256 + 32)))
    with Image.open(tmp_path / "pictures" / "mirror" / "hard_03.png") as sheet:
        expected = np.asarray(sheet.crop((0, 0, sheet.width, 256 + 32)))
    assert np.array_equal(first, expected)


@pytest.mark.usefixtures("undrawn")
def test_doubtful_comparisons_are_a_warning(one_scene, make_run, capsys) -> None:
    def elsewhere(result: dict) -> None:
        result["machine"] = {"processor": "another", "backend": "llvm"}
        result["run_seconds"] = 1.1 * result["run_seconds"]

    folder = make_run(sampler="mcmc_loss", change=elsewhere)
    assert main([str(one_scene)]) == 0
    printed = capsys.readouterr().err
    written = (one_scene / "report" / "results.md").read_text()
    times = f"mirror: the runs had different run times: 240 s in {one_scene}"
    machines = "the runs come from different machines: "
    for line in (times, machines):
        assert f"warning: {line}" in printed
        assert f"- Warning: {line}" in written
    assert f"264 s in {folder}" in printed
    assert f"another, llvm in {folder}" in written


@pytest.mark.usefixtures("undrawn")
def test_short_times_are_told_apart(make_run, tmp_path, capsys) -> None:
    for sampler, seconds in (("uniform", 4.6), ("mcmc_loss", 5.3)):
        make_run(sampler=sampler, change=lambda result, t=seconds: result.update(run_seconds=t))
    assert main([str(tmp_path / "runs")]) == 0
    told = capsys.readouterr().err
    assert "different run times: 4.6 s in" in told
    assert ", 5.3 s in" in told


@pytest.mark.usefixtures("undrawn")
def test_scenes_may_take_different_times(one_scene, make_run, capsys) -> None:
    make_run(scene="sphere-caustic", change=lambda result: result.update(run_seconds=900.0))
    assert main([str(one_scene)]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("undrawn")
def test_floors_that_are_lower_bounds_are_called_so(one_scene, capsys) -> None:
    assert main([str(one_scene)]) == 0
    assert "for DSSIM and LPIPS a lower bound" in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_the_two_means_of_differences_are_told_apart(one_scene, tmp_path, capsys) -> None:
    ratios = [0.4, 0.9, 1.8]
    means = [100 * mean(ratios) - 100 for mean in (np.mean, stats.gmean)]
    shown = "arithmetic mean is {:+.1f} %, their geometric mean {:+.1f} %".format(*means)
    assert main([str(one_scene)]) == 0
    for text in (capsys.readouterr().out, (one_scene / "report" / "results.md").read_text()):
        assert shown in text
    (alone := tmp_path / "alone").mkdir()
    (one_scene / "mirror" / "uniform").rename(alone / "uniform")
    assert main([str(alone)]) == 0
    assert "geometric" not in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_missing_pictures_are_a_warning(two_scenes, capsys) -> None:
    (two_scenes / "mirror" / "uniform" / "seed=0" / "pictures" / "hard_01_error.png").unlink()
    assert main([str(two_scenes)]) == 0
    output = capsys.readouterr()
    assert "warning: no comparison pictures of mirror" in output.err
    assert "sphere-caustic.png" in output.out


@pytest.mark.usefixtures("undrawn")
def test_left_out_runs_are_a_warning(one_scene, capsys) -> None:
    folder = one_scene / "mirror" / "uniform" / "seed=0"
    (folder / "result.json").unlink()
    assert main([str(one_scene)]) == 0
    assert f"warning: left out: {folder}: unfinished" in capsys.readouterr().err


@pytest.mark.usefixtures("undrawn")
def test_why_lpips_is_empty_is_said(make_run, tmp_path, capsys) -> None:
    make_run(lpips=False)
    assert main([str(tmp_path)]) == 0
    assert "LPIPS is empty: no AlexNet weights" in capsys.readouterr().out


def test_what_cannot_be_reported_is_one_line_and_writes_nothing(make_run, tmp_path, capsys) -> None:
    make_run(seed=0)
    make_run(seed=1, change=lambda result: result["protocol"].update(identity="other"))
    assert main([str(tmp_path / "runs")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: runs with different protocols")
    assert error.count("\n") == 1
    assert not (tmp_path / "runs" / "report").exists()


def test_a_figure_s_files_are_arranged_alike(tmp_path, monkeypatch) -> None:
    figure = plots.new_figure(6, 3)
    for axes in figure.subplots(1, 2):
        axes.set_title("a title that is as wide as its panel")
        axes.set_ylabel("errors")
    before, places = [axes.get_position().bounds for axes in figure.axes], []
    drawn = plots.figure_bytes

    def noted(figure: Figure, suffix: str) -> bytes:
        data = drawn(figure, suffix)
        places.append([axes.get_position().bounds for axes in figure.axes])
        return data

    monkeypatch.setattr(plots, "figure_bytes", noted)
    with matplotlib.rc_context(plots.STYLE):
        written = plots.save_figure(figure, tmp_path, "two panels")
    names = [f"two panels.{suffix}" for suffix in FORMATS]
    assert [file.name for file in written] == names
    assert places[0] == places[1] == places[2] != before
    pdf = written[2].read_bytes()
    assert pdf.startswith(b"%PDF")
    assert b"CreationDate" not in pdf  # the same runs give the same bytes
    assert b"/Type3" not in pdf


def test_method_keeps_its_colour_in_every_scene(two_scenes) -> None:
    runs = name_methods(find_runs(two_scenes)[0])
    styles = method_styles(runs)
    assert [style["color"] for style in styles.values()] == list(COLOURS[:2])
    mirror = [run for run in runs if run.scene == "mirror"]
    assert method_styles(mirror) == styles


def run_with(points: list[tuple[float, float | None]]) -> Run:
    history = pd.DataFrame(points, columns=["run_seconds", "hard_mape"])
    return Run(Path(), {}, history)


def test_curve_averages_seeds_at_common_times() -> None:
    first = run_with([(0.0, 4.0), (10.0, 2.0), (12.0, float("inf")), (20.0, 1.0)])
    second = run_with([(5.0, 8.0), (15.0, 4.0), (25.0, 2.0)])
    curve = error_curve([first, second], "hard_mape")
    assert curve is not None
    assert curve.seconds.tolist() == [5.0, 10.0, 20.0]
    assert curve.mean.tolist() == [(3 + 8) / 2, (2 + 6) / 2, (1 + 3) / 2]
    assert curve.n == 2


def test_curve_without_values_or_common_times_is_none() -> None:
    run = run_with([(0.0, 1.0), (1.0, 0.5)])
    assert error_curve([run], "hard_lpips") is None
    lacking = Run(Path(), {}, run.history.assign(hard_lpips=None))
    assert error_curve([run, lacking], "hard_lpips") is None
    assert error_curve([lacking], "hard_lpips") is None
    assert error_curve([run_with([(0.0, math.nan)])], "hard_mape") is None
    assert error_curve([run, run_with([(5.0, 1.0)])], "hard_mape") is None


def test_report_needs_neither_ngi_nor_torch_nor_mitsuba(one_scene) -> None:
    program = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("ngi", "torch", "mitsuba", "drjit", "lightning"):
            raise AssertionError(f"analysis imports {name}")

sys.meta_path.insert(0, Blocker())
from analysis.report import main
sys.exit(main(sys.argv[1:]))
"""
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    subprocess.run(
        [sys.executable, "-W", "error", "-c", program, str(one_scene)],
        check=True,
        env=environment,
        capture_output=True,
    )
