import json
from pathlib import Path

import numpy as np
import pytest

from analysis.methods import baselines, differing_fields, methods_in_order, name_methods, title
from analysis.runs import check_comparable, find_runs
from tests.analysis.changes import set_value
from tests.analysis.traces import CHAINS, write_trace


def methods(folder: Path) -> list[str]:
    return methods_in_order(name_methods(find_runs(folder)[0]))


def check(folder: Path) -> None:
    check_comparable(name_methods(find_runs(folder)[0]))


def test_runs_are_found_and_read(make_run, tmp_path) -> None:
    make_run(seed=0)
    make_run(seed=1, lpips=False)
    runs, warnings = find_runs(tmp_path)
    assert warnings == []
    assert [run.seed for run in runs] == [0, 1]
    assert runs[0].scene == "mirror"
    assert len(runs[0].history) == 9
    assert runs[0].metric("hard", "lpips") is not None
    assert runs[1].metric("hard", "lpips") is None


def test_samplers_alone_name_methods_that_need_no_more(make_run, tmp_path) -> None:
    make_run(sampler="uniform")
    make_run(sampler="mcmc_loss_step", resolution="growing", overrides="method=exploration")
    assert methods(tmp_path) == ["uniform", "mcmc_loss_step"]


def test_what_differs_within_a_sampler_is_part_of_the_name(make_run, tmp_path) -> None:
    make_run(sampler="uniform", resolution="constant")
    make_run(sampler="uniform", resolution="growing", overrides="resolution=growing")
    make_run(sampler="mcmc_loss")
    assert methods(tmp_path) == ["uniform, constant", "uniform, growing", "mcmc_loss"]
    runs = find_runs(tmp_path)[0]
    assert differing_fields(runs) == ["sampler", "resolution", "overrides"]


def test_of_overrides_only_the_differing_ones_are_named(make_run, tmp_path) -> None:
    make_run(overrides="model.hidden_layers=3,loss.beta=1")
    make_run(overrides="model.hidden_layers=3,loss.beta=2")
    assert methods(tmp_path) == ["uniform, loss.beta=1", "uniform, loss.beta=2"]


def test_what_differs_between_scenes_only_is_not_part_of_the_name(make_run, tmp_path) -> None:
    make_run(scene="mirror", budget="seconds")
    make_run(scene="sphere-caustic", budget="paper")
    assert methods(tmp_path) == ["uniform"]


def test_options_of_method_are_the_names(make_run, tmp_path) -> None:
    make_run(sampler="mcmc_metropolis", method="metropolis")
    make_run(sampler="mcmc_loss_step", method="traced_specular")
    make_run(sampler="mcmc_loss_step", method="active_exploration")
    make_run(sampler="uniform", method="uniform_growing", resolution="growing")
    make_run(sampler="uniform", method="uniform")
    make_run(sampler="mcmc_release")
    make_run(scene="chess", sampler="mcmc_loss_step", method="active_exploration", reuse="never")
    assert methods(tmp_path) == [
        "uniform",
        "active_exploration",
        "metropolis",
        "uniform_growing",
        "traced_specular",
        "mcmc_release",
    ]


def test_a_method_run_in_two_ways_is_two(make_run, tmp_path) -> None:
    make_run(method="active_exploration", reuse="never")
    make_run(method="active_exploration", reuse="self_tuning")
    names = ["active_exploration, never", "active_exploration, self_tuning"]
    assert methods(tmp_path) == names
    assert title(names[0]) == "Active Exploration, never"
    assert title("mcmc_release") == "mcmc_release"


def test_a_sampler_in_place_of_a_methods_own_is_part_of_the_name(make_run, tmp_path) -> None:
    make_run(sampler="sobol", method="ours")
    for name in ("mine", "uniform"):
        make_run(sampler=name, method="ours", overrides=f"method=ours,sampler={name},seed=0")
    names = ["ours, sampler=uniform", "ours", "ours, sampler=mine"]
    assert methods(tmp_path) == names
    assert [title(name) for name in names] == names
    assert baselines(dict.fromkeys(names)) == [(name, names[0]) for name in names[1:]]


def test_that_sampler_is_named_where_nothing_else_was_run(make_run, tmp_path) -> None:
    make_run(sampler="mine", method="ours", overrides="sampler=mine")
    assert methods(tmp_path) == ["ours, sampler=mine"]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("protocol", "identity"), "other", r"demo \(0123456789abcdef\).*demo \(other\)"),
        (("scene_hash",), "changed", "versions of the scene.*mirror-files.*changed"),
        (("reference_hash",), "changed", "reference images.*mirror-references.*changed"),
    ],
)
def test_what_differs_in_measure_is_not_mixed(make_run, tmp_path, path, value, message) -> None:
    first = make_run(seed=0)
    second = make_run(seed=1, change=set_value(*path, value=value))
    with pytest.raises(ValueError, match=message) as error:
        check(tmp_path)
    assert str(first) in str(error.value)
    assert str(second) in str(error.value)


def test_scenes_may_have_hashes_of_their_own(make_run, tmp_path) -> None:
    make_run(scene="mirror")
    make_run(scene="sphere-caustic")
    check(tmp_path)


def test_a_seed_counts_once_per_method(make_run, tmp_path) -> None:
    make_run(seed=3)
    folder = make_run(seed=4, change=set_value("seed", value=3))
    with pytest.raises(ValueError, match=rf"{folder}.*same method \(uniform\).*seed \(3\)"):
        check(tmp_path)


def test_other_schema_version_is_refused(make_run, tmp_path) -> None:
    make_run()
    folder = make_run(seed=1, change=set_value("schema_version", value=2))
    with pytest.raises(ValueError, match=rf"{folder}/result.json: schema_version is 2"):
        find_runs(tmp_path)


def damage(folder: Path, kind: str) -> None:
    file = folder / "result.json"
    if kind == "no result":
        file.unlink()
    elif kind == "cut":
        file.write_text(file.read_text()[:100])
    elif kind == "binary":
        file.write_bytes(b"\xff\xfe\x00")
    elif kind == "not an object":
        file.write_text("[1]")
    elif kind == "unfinished":
        file.write_text(json.dumps(json.loads(file.read_text()) | {"finished": False}))
    elif kind == "incomplete":
        result = json.loads(file.read_text())
        del result["metrics"]["hard"]["mape"]["floor"]
        file.write_text(json.dumps(result))
    elif kind == "no history":
        (folder / "metrics.csv").unlink()
    elif kind == "empty history":
        (folder / "metrics.csv").write_text("")
    elif kind == "trace alone":
        write_trace(folder, np.zeros((2, CHAINS, 4)), np.ones((2, CHAINS), bool))
    elif kind == "foreign history":
        (folder / "metrics.csv").write_text("a,b\n1,2\n")


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("no result", "unfinished"),
        ("cut", "cannot be read"),
        ("binary", "cannot be read"),
        ("not an object", "cannot be read"),
        ("unfinished", "unfinished"),
        ("incomplete", "incomplete (no 'floor')"),
        ("no history", "metrics.csv cannot be read"),
        ("empty history", "metrics.csv cannot be read"),
        ("foreign history", "metrics.csv cannot be read"),
        ("trace alone", "there is a chains.bin but no steps.csv"),
    ],
)
def test_damaged_and_unfinished_runs_are_named(make_run, tmp_path, kind: str, reason: str) -> None:
    make_run(seed=0)
    folder = make_run(seed=1)
    damage(folder, kind)
    runs, warnings = find_runs(tmp_path)
    assert [run.seed for run in runs] == [0]
    (warning,) = warnings
    assert str(folder) in warning
    assert reason in warning


def test_folder_without_runs_is_an_error(make_run, tmp_path) -> None:
    with pytest.raises(ValueError, match="no finished run"):
        find_runs(tmp_path)
    with pytest.raises(ValueError, match="there is no such folder"):
        find_runs(tmp_path / "nowhere")
    damage(make_run(), "no result")
    with pytest.raises(ValueError, match=r"no finished run.*unfinished"):
        find_runs(tmp_path)
