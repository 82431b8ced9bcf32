"""What is said of runs that can be compared, but whose comparison is doubtful."""

import math
import shutil

import pandas as pd
import pytest

from analysis.doubts import comparison_warnings
from analysis.runs import find_runs
from tests.analysis.changes import set_value


def test_two_clocks_in_one_comparison_are_a_doubt(make_run, tmp_path) -> None:
    wall = make_run(seed=0)  # of before there were two clocks
    assert comparison_warnings(find_runs(tmp_path)[0]) == []
    model = make_run(seed=1, change=set_value("clock", value="model"))
    (warning,) = comparison_warnings(find_runs(tmp_path)[0])
    assert f"different clocks: wall in {wall}; model in {model}" in warning


@pytest.mark.parametrize(
    ("part", "value"), [("cores", 16), ("gpu", "NVIDIA H200"), ("processor", "another")]
)
def test_two_machines_in_one_comparison_are_a_doubt(make_run, tmp_path, part, value) -> None:
    machine = {"processor": "abacus", "backend": "llvm", "cores": 2, "gpu": None}
    make_run(seed=0, change=set_value("machine", value=machine))
    make_run(seed=1, change=set_value("machine", value={**machine}))
    assert comparison_warnings(find_runs(tmp_path)[0]) == []
    before = {key: machine[key] for key in ("processor", "backend")}
    older = make_run(seed=3, change=set_value("machine", value=before))  # and nobody knows
    assert comparison_warnings(find_runs(tmp_path)[0]) == []
    shutil.rmtree(older)
    other = make_run(seed=2, change=set_value("machine", value={**machine, part: value}))
    (warning,) = comparison_warnings(find_runs(tmp_path)[0])
    assert str(value) in warning
    assert str(other) in warning


def test_several_commits_and_changed_files_are_doubts(make_run, tmp_path) -> None:
    make_run(seed=0, change=set_value("commit", value="a" * 40))
    two = [{"commit": "a" * 40}, {"commit": "b" * 40}]
    make_run(seed=1, change=set_value("commits", value=two))
    changed = make_run(seed=2, change=set_value("dirty", value=True))
    dirty, commits = comparison_warnings(find_runs(tmp_path)[0])
    assert f"1 run(s) were made with uncommitted changes, for example {changed}" in dirty
    assert "different commits: aaaaaaaaaaaa in" in commits
    assert "aaaaaaaaaaaa then bbbbbbbbbbbb in" in commits


def test_changes_are_told_apart_where_their_program_is_known(make_run, tmp_path) -> None:
    for seed, code in enumerate("112"):
        version = {"commit": "a" * 40, "dirty": True, "code": code * 16}
        make_run(seed=seed, change=set_value("commits", value=[version]))
    dirty, commits = comparison_warnings(find_runs(tmp_path)[0])
    assert "3 run(s) were made with uncommitted changes" in dirty
    assert "commits: aaaaaaaaaaaa and changes (11111111) in" in commits
    assert "; aaaaaaaaaaaa and changes (22222222) in" in commits
    assert commits.count(" in ") == 2


def test_a_run_that_was_dirty_before_it_went_on_is_a_doubt(make_run, tmp_path) -> None:
    two = [{"commit": "a" * 40, "dirty": dirty, "code": "1"} for dirty in (True, False)]
    make_run(change=set_value("commits", value=two))
    (dirty,) = comparison_warnings(find_runs(tmp_path)[0])
    assert "1 run(s) were made with uncommitted changes" in dirty


def test_commits_that_changed_nothing_of_the_program_are_said_to_be_such(
    make_run, tmp_path
) -> None:
    for seed, commit in enumerate("ab"):
        version = {"commit": commit * 40, "dirty": False, "code": "1" * 16}
        make_run(seed=seed, change=set_value("commits", value=[version]))
    (commits,) = comparison_warnings(find_runs(tmp_path)[0])
    assert commits.endswith("; the program itself is the same")


def test_runs_that_diverged_are_named(make_run, tmp_path) -> None:
    for seed in range(3):
        folder = make_run(seed=seed)
    table = pd.read_csv(folder / "metrics.csv")
    table.loc[len(table) - 1, "uniform_mape"] = math.inf
    table.to_csv(folder / "metrics.csv", index=False)
    (warning,) = comparison_warnings(find_runs(tmp_path)[0])
    assert warning.startswith("1 run(s) ended with errors that are not finite")
    assert warning.endswith(f": {folder}")


def test_runs_of_one_method_with_other_settings_are_a_doubt(make_run, tmp_path) -> None:
    small, large = (
        {"model": {"width": w, "depth": 6}, "seed": w, "costs": {"a": w}} for w in (1, 2)
    )
    small["sampler"] = {"proposal": {"seed": 1}}  # as a Sobol sequence has it
    same = {**small, "seed": 9, "costs": {"a": 9}, "sampler": {"proposal": {"seed": 9}}}
    same["new"] = None  # of a later version
    for seed, config in enumerate((small, same)):
        make_run(seed=seed, change=set_value("config", value=config))
    assert comparison_warnings(find_runs(tmp_path)[0]) == []
    folder = make_run(seed=2, change=set_value("config", value={**large, "x": {"y": [3]}}))
    make_run(seed=3, scene="other", change=set_value("config", value=large))
    (warning,) = comparison_warnings(find_runs(tmp_path)[0])
    assert warning.startswith("mirror: runs of")
    assert "differ in model.width (1 and 2), x.y (None and [3]): /" in warning
    assert warning.endswith(f"seed=0 and {folder}")
