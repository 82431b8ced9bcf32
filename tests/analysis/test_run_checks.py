"""Damage to a run's files: the run is left out by name, whatever else is there is reported."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.exploration import exploration_numbers
from analysis.report import main
from analysis.runs import find_runs
from tests.analysis.traces import write_logs


def cut_by_a_line(file: Path) -> None:
    file.write_text("".join(file.read_text().splitlines(keepends=True)[:-1]))


def cut_by_a_record(file: Path) -> None:
    """Which leaves a file that looks whole."""
    content = file.read_bytes()
    record = (len(content) - content.index(b"\n") - 1) // 10
    file.write_bytes(content[:-record])


def changed_in_place(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[-3] ^= 1
    file.write_bytes(content)


DAMAGE: list[tuple[str, Callable[[Path], Any], str]] = [
    ("metrics.csv", cut_by_a_line, "metrics.csv is damaged: it has"),
    ("chains.bin", cut_by_a_record, "chains.bin is damaged: it has"),
    ("chains.bin", changed_in_place, "chains.bin is damaged: its checksum"),
    ("chains.bin", Path.unlink, "chains.bin is missing"),
    ("steps.csv", lambda file: file.write_text(""), "steps.csv is damaged: it has 0 bytes"),
]


@pytest.mark.parametrize(("name", "damage", "reason"), DAMAGE)
def test_damaged_logs_are_seen(make_run, tmp_path, name, damage, reason) -> None:
    for seed in (0, 1):
        write_logs(make_run(seed=seed))
    assert find_runs(tmp_path)[1] == []
    folder = tmp_path / "runs" / "mirror" / "uniform" / "seed=1"
    damage(folder / name)
    runs, (warning,) = find_runs(tmp_path)
    assert [run.seed for run in runs] == [0]
    assert f"left out: {folder}: {reason}" in warning


def replace_in(name: str, old: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        content = (folder / name).read_text()
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1))

    return change


def without_checksums(name: str, damage: Callable[[Path], Any]) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        file = folder / "result.json"
        file.write_text(json.dumps({**json.loads(file.read_text()), "logs": {}}))
        damage(folder / name)

    return change


def of_before_checksums(folder: Path) -> None:
    file = folder / "result.json"
    result = json.loads(file.read_text())
    del result["logs"]
    file.write_text(json.dumps(result))
    cut_by_a_line(folder / "metrics.csv")


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (of_before_checksums, "metrics.csv is cut short: it ends with step 700"),
        (
            without_checksums("steps.csv", lambda file: file.write_text("")),
            "steps.csv cannot be read (No columns",
        ),
        (
            without_checksums("steps.csv", lambda file: file.write_text("step,run_seconds\n")),
            "steps.csv has no row",
        ),
        (
            without_checksums("metrics.csv", lambda file: file.write_text("step,a\n1,2\n")),
            "metrics.csv cannot be read (no column 'run_seconds')",
        ),
        (
            without_checksums(
                "metrics.csv", lambda f: f.write_text("step,run_seconds,a\n1,2,3\n2,3,x\n")
            ),
            "metrics.csv, line 3: a is 'x', which is not a number",
        ),
        (
            without_checksums("chains.bin", lambda file: file.write_bytes(b"?\n")),
            "chains.bin is damaged (first line",
        ),
        (replace_in("result.json", '"index": 0', '"index": "a"'), "frames.0.index is 'a'"),
        (replace_in("result.json", '"floor": 0', '"floor": "x", "f": 0'), "floor is 'x', which"),
        (replace_in("result.json", '"logs": {', '"logs": {"a": 1, '), "result.json is incomplete"),
        (
            without_checksums(
                "metrics.csv", lambda f: f.write_text(f"step,run_seconds\n1,2\n2,{10**400}\n")
            ),
            "metrics.csv, line 3: run_seconds is 1000",
        ),
        (replace_in("result.json", '"set"', '"sets"'), "no 'set'"),
        (
            replace_in("result.json", '"logs": {', '"frame": {"samples_per_pixel": 8}, "logs": {'),
            "no 'milliseconds'",
        ),
        (
            replace_in("result.json", '"logs": {', '"frame_seconds": {"buffers": null}, "logs": {'),
            "frame_seconds.buffers is 'None'",
        ),
        (replace_in("result.json", '"seconds": {', '"minutes": {'), "no 'seconds'"),
        (replace_in("result.json", '"patches_traced": ', '"patches_traced": "x", "p": '), "is 'x'"),
        (replace_in("result.json", '"reuse": "self_tuning"', '"reuse": true'), "is not a text"),
        (
            replace_in("result.json", '"train": 120.0', '"train": 1' + 400 * "0"),
            "seconds.train is '1000",
        ),
    ],
)
def test_what_cannot_be_read_is_left_out_of_the_report(make_run, tmp_path, damage, reason) -> None:
    for seed in (0, 1):
        write_logs(make_run(seed=seed))
    folder = tmp_path / "runs" / "mirror" / "uniform" / "seed=1"
    damage(folder)
    runs, (warning,) = find_runs(tmp_path)
    assert [run.seed for run in runs] == [0]
    assert reason in warning


@pytest.mark.usefixtures("undrawn")
def test_the_rest_is_reported(make_run, tmp_path, capsys) -> None:
    for seed in (0, 1):
        write_logs(make_run(seed=seed))
    folder = tmp_path / "runs" / "mirror" / "uniform" / "seed=1"
    without_checksums("steps.csv", lambda file: file.write_text(""))(folder)
    assert main([str(tmp_path / "runs")]) == 0
    assert f"left out: {folder}: steps.csv" in capsys.readouterr().err
    assert (tmp_path / "runs" / "report" / "index.html").exists()


def test_columns_that_a_run_did_not_log_are_left_empty(make_run, tmp_path) -> None:
    folder = make_run()
    write_logs(folder)
    without_checksums("steps.csv", lambda f: f.write_text("step,run_seconds\n1,2\n9,3\n"))(folder)
    (run,) = find_runs(tmp_path)[0]
    numbers = exploration_numbers(run)
    assert numbers is not None
    assert numbers["acceptance"] == 1
    assert np.isnan([numbers["store_size"], numbers["reuse_probability"]]).all()


def test_a_text_as_a_frame_s_error_is_named(make_run, tmp_path) -> None:
    def change(result: dict[str, Any]) -> None:
        result["frames"][2]["mape"] = "much"

    make_run(seed=0)
    make_run(seed=1, change=change)
    _, (warning,) = find_runs(tmp_path)
    assert "frames.2.mape is 'much', which is not a number" in warning
