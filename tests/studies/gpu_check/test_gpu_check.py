"""The GPU check is cut off, crashes and fails, and still comes to an end; and its dry run."""

import json
import time
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import torch

from ngi.machine.provenance import provenance
from ngi.render import AnalyticRenderer
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.scenes import one_per_folder, shipped
from ngi.studies.gpu_check import runs
from ngi.studies.gpu_check.__main__ import check, work
from ngi.studies.gpu_check.item import CutOffError, Item, Outcome
from ngi.studies.gpu_check.pixels import differences, pixels
from ngi.studies.gpu_check.plan import Sizes, items
from ngi.studies.gpu_check.record import Record
from ngi.studies.gpu_check.runs import METHODS, run
from tests.learn.command_line import run_module

TRAINED = ("active_exploration", "uniform", "ours", "ours_small_patches")
ABOUT = {
    "machine": {"gpu": "Some GPU", "processor": "x", "backend": "cuda"},
    "versions": {"torch": "2"},
    "commit": "abc",
    "dirty": False,
}


class Measuring:
    """Items that note what is done to them. Each of `answers` is given or raised in turn."""

    def __init__(self, *answers: Exception | BaseException | None) -> None:
        self.answers: Iterator[Exception | BaseException | None] = iter(answers)
        self.calls = 0

    def __call__(self, _: float) -> Outcome:
        self.calls += 1
        answer = next(self.answers)
        if answer is not None:
            raise answer
        return Outcome([figure("speed", [2.0], "m/s")], ["a note"])


def checked(folder: Path, *every: Item, seconds: float = 1e6) -> Record:
    """After one call, as of a new process."""
    record = Record(folder, about=ABOUT)
    work(every, record, end=time.monotonic() + seconds)
    return Record(folder, about=ABOUT)


def test_a_stage_of_several_parts_has_a_table_of_each(tmp_path: Path) -> None:
    figures = [
        Figure("step", 1, 1, 1, "ms", part="speed", scene="salon"),
        Figure("step", 2, 2, 2, "%", part="share", scene="mirror"),
    ]
    item = Item("stage", "name", lambda _: Outcome(figures))
    record = checked(tmp_path, item)
    record.write_page([item])
    headings = [line for line in record.page.read_text().splitlines() if line.startswith("### ")]
    assert headings == ["### stage: speed", "### stage: share"]


def test_what_is_measured_is_not_measured_again(tmp_path: Path) -> None:
    measure = Measuring(None)
    item = Item("stage", "name", measure)
    for _ in range(2):
        record = checked(tmp_path, item)
    assert measure.calls == 1
    assert record.to_do([item]) == []
    page = record.page.read_text()
    assert "Some GPU" in page
    assert "| speed | 2 m/s |" in page
    assert "stage/name: a note" in page
    kept = json.loads(record.path.read_text())["items"]["stage/name"]
    assert kept["figures"][0]["median"] == 2
    assert kept["machine"]["gpu"] == "Some GPU"


def test_an_item_that_fails_leaves_the_others_and_is_tried_again(tmp_path: Path) -> None:
    bad, good = Measuring(RuntimeError("no rays\nat all"), None), Measuring(None)
    every = Item("a", "bad", bad), Item("b", "good", good)
    record = checked(tmp_path, *every)
    assert record.failed(every) == {"a/bad": "RuntimeError: no rays\nat all"}
    assert "- a/bad: RuntimeError: no rays\n" in record.page.read_text()
    record = checked(tmp_path, *every)
    assert (bad.calls, good.calls) == (2, 1)
    assert record.failed(every) == {}


def test_an_item_that_kills_its_process_is_begun_twice_at_most(tmp_path: Path) -> None:
    measure = Measuring(*[SystemExit()] * 5)  # what nothing is written after
    item = Item("stage", "name", measure)
    for _ in range(2):
        with pytest.raises(SystemExit):
            checked(tmp_path, item)
    record = checked(tmp_path, item)
    record.write_page([item])
    assert measure.calls == 2
    why = "begun 2 times and never ended"
    assert why in record.page.read_text()
    assert why in record.failed([item])["stage/name"]  # so that the exit status is 1


def test_one_that_goes_on_is_begun_as_often_as_it_is_cut_off(tmp_path: Path) -> None:
    measure = Measuring(*[CutOffError()] * 3, SystemExit(), SystemExit(), None)
    item = Item("stage", "name", measure, goes_on=True)
    for _ in range(3):
        assert checked(tmp_path, item).to_do([item]) == [item]
    for _ in range(2):
        with pytest.raises(SystemExit):
            checked(tmp_path, item)
    assert checked(tmp_path, item).to_do([item]) == []
    assert measure.calls == 6


def test_ctrl_c_is_no_crash_of_what_was_measured(tmp_path: Path) -> None:
    item = Item("stage", "name", Measuring(*[KeyboardInterrupt()] * 4, None))
    for _ in range(4):
        with pytest.raises(KeyboardInterrupt):
            checked(tmp_path, item)
    assert checked(tmp_path, item).to_do([item]) == []


def test_training_for_longer_is_another_item(tmp_path: Path) -> None:
    def trained(seconds: float) -> list[Item]:
        every = items(Sizes(), tmp_path, training_seconds=seconds)
        return [item for item in every if item.stage == "training"]

    record = Record(tmp_path, about=ABOUT)
    for item in trained(900):
        record.done(item, Outcome([figure("speed", [2.0], "m/s")]))
    assert record.to_do(trained(900)) == []
    assert len(record.to_do(trained(3600))) == len(trained(3600)) > 0


def test_figures_of_an_earlier_commit_say_so(tmp_path: Path) -> None:
    item = Item("stage", "name", Measuring(None))
    checked(tmp_path, item)
    record = Record(tmp_path, about={**ABOUT, "commit": "def"})
    record.write_page([item])
    assert "- stage/name: measured at commit abc" in record.page.read_text()


def test_nothing_is_begun_that_may_not_end_in_time(tmp_path: Path) -> None:
    long, on = Measuring(None), Measuring(None)
    every = Item("a", "", long, seconds=100), Item("b", "", on, seconds=100, goes_on=True)
    checked(tmp_path, *every, seconds=50)
    assert (long.calls, on.calls) == (0, 1)
    checked(tmp_path / "late", *every, seconds=-1)
    assert (long.calls, on.calls) == (0, 1)


def test_pixels_differ_where_they_differ() -> None:
    buffers, radiance = torch.rand(10, 10, 4), torch.rand(10, 10, 3) + 1
    moved, brighter = buffers.clone(), radiance.clone()
    moved[0, :3, 2] += 0.1
    moved[1, 0, 0] = torch.nan
    brighter[:5] *= 1.1
    by_name = {f.name: f.median for f in differences((buffers, radiance), (moved, brighter))}
    assert by_name["pixels whose buffers differ"] == pytest.approx(4)
    assert by_name["pixels whose radiance differs"] == pytest.approx(50)
    mean = 100 * (brighter.mean() / radiance.mean() - 1).item()
    assert by_name["difference of mean radiance"] == pytest.approx(mean, rel=1e-3)


def test_pixels_have_what_those_of_ours_have(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def renderer(**options: Any) -> AnalyticRenderer:
        made.append(options)
        return AnalyticRenderer(dimensions=3, patch_size=16)

    monkeypatch.setattr("ngi.studies.gpu_check.pixels.MitsubaRenderer", renderer)
    (scene,) = shipped(["mirror"])
    found = pixels(scene, resolution=16, samples=2)
    assert [figure.median for figure in found.figures] == [0, 0, 0]
    assert all((each["specular"], each["direct"]) == OF_OURS for each in made)
    assert len(made) == 2


OF_OURS = ("traced", "with_caustics")


def test_at_full_size_it_measures_every_scene_method_and_part(tmp_path: Path) -> None:
    every = items(Sizes(), tmp_path, training_seconds=600)
    keys = [item.key for item in every]
    assert len(set(keys)) == len(keys)
    assert {item.name for item in every if item.stage == "learning"} == set(METHODS)
    assert sum(item.stage == "pixels" for item in every) == len(one_per_folder())
    assert all(item.seconds < 600 for item in every)
    for scene, method in product(("living-room", "sphere-caustic"), TRAINED):
        assert f"training/{scene}, {method}, 600 s" in keys
    assert "benchmark/training" in keys


def test_a_damaged_record_is_named_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def begin(every: Sequence[Item], record: Record, **_: object) -> None:
        record.begin(every[0])

    monkeypatch.setattr("ngi.studies.gpu_check.__main__.work", begin)
    words = ("--dry-run", "--output", str(tmp_path))
    check(words)
    (file,) = tmp_path.rglob("gpu-check.json")
    file.write_text("{}")
    assert check(words) == 1
    assert f"{file} is damaged" in capsys.readouterr().err


def test_ctrl_c_ends_the_check_without_a_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("ngi.studies.gpu_check.__main__.work", interrupted)
    assert check(["--dry-run", "--output", str(tmp_path)]) == 130


def test_without_a_gpu_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if torch.cuda.is_available():
        pytest.skip("there is a GPU")
    assert check(["--output", str(tmp_path)]) == 1
    assert "--dry-run" in capsys.readouterr().out


def short_run(folder: Path, overrides: Sequence[str], *, seconds: float) -> dict[str, Any]:
    """`runs.run` in a process that need not import everything first; only for those that learn."""
    if "learning" not in folder.parts:
        return run(folder, overrides, seconds=seconds)
    words = (*overrides, f"run.folder={folder}")
    status, output = run_module("ngi.train", *words, folder=folder.parents[2])
    assert status == 0, output
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return result


def test_a_methods_runs_share_the_seconds_that_are_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, given = [100.0], []

    def cut_off_third(*_: Any, seconds: float) -> dict[str, Any]:
        given.append(seconds)
        now[0] += 40
        if len(given) == 3:
            raise CutOffError("run goes on next time")
        return {"metrics": {"hard": {"mape": {"mean": 1.0}}}}

    monkeypatch.setattr(runs, "monotonic", lambda: now[0])
    monkeypatch.setattr(runs, "run", cut_off_third)
    monkeypatch.setattr(runs, "read_checkpoint", lambda _: {"state_dict": {}})
    with pytest.raises(CutOffError):
        runs.learning("ours", tmp_path, 90)
    assert given == [90, 50, 10]


def test_the_dry_run_goes_through_everything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ngi.studies.gpu_check.runs.run", short_run)
    assert check(["--dry-run", "--output", str(tmp_path)]) == 0
    (file,) = tmp_path.rglob("gpu-check.json")
    found = json.loads(file.read_text())["items"]
    stages = {key.partition("/")[0] for key in found}
    assert stages == {"doctor", "learning", "pixels", "benchmark", "graphs", "training", "frames"}
    assert all("figures" in entry for entry in found.values())
    learnt = {f["name"]: f["median"] for f in found["learning/active_exploration"]["figures"]}
    for name in ("a run repeats bit for bit", "the same bits as CUDA graphs"):
        assert learnt[f"active_exploration: {name}"] == 1
    for name in ("step, paper", "step, ours", "frame"):
        *_, apart = found[f"graphs/{name}"]["figures"]
        assert ("largest difference" in apart["name"], apart["median"]) == (True, 0)
    assert {"commit", "versions"} <= provenance(backend="").keys() & found["doctor"].keys()
