import json
import math
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from scipy.stats import gmean

from analysis import load_runs
from analysis.runs import FURTHER
from tests.analysis.changes import set_value

REPOSITORY = Path(__file__).resolve().parents[2]
HARD_MAPE = "set == 'hard' and metric == 'mape' and statistic == 'mean'"


@pytest.fixture
def folder(make_run, tmp_path) -> Path:
    for seed in range(2):
        make_run(seed=seed, method="uniform")
        make_run(seed=seed, method="active_exploration", quality=2.0, lpips=False)
    make_run(scene="chess", method="uniform")
    return tmp_path / "runs"


def test_runs_have_labels_costs_and_provenance(folder) -> None:
    runs = load_runs(str(folder)).runs
    assert len(runs) == 5
    assert runs[["scene", "method", "seed"]].drop_duplicates().shape[0] == 5
    row = runs.query("scene == 'mirror' and method == 'uniform' and seed == 1").iloc[0]
    assert (row["label.reuse"], row["protocol.name"]) == ("self_tuning", "demo")
    assert (row["run_seconds"], row["steps"], row["seconds.render"]) == (241.0, 1010, 100.0)
    assert row["scene_hash"] == "mirror-files"
    assert Path(row["folder"]).is_dir()


def test_configs_have_a_column_for_each_setting(make_run, tmp_path) -> None:
    """A sweep of two widths, whose runs are told apart by a string alone, and path tracing."""
    for width in (64, 128):
        config = {"seed": 0, "model": {"hidden_features": width, "bounds": [0, 1]}}
        make_run(
            overrides=f"model.hidden_features={width}",
            change=set_value("config", value=config),
        )
    make_run(sampler="none")
    results = load_runs(tmp_path)
    keys = ["scene", "method", "seed", "folder"]
    assert results.configs[keys].equals(results.runs[keys])
    settings = results.configs.drop(columns=keys).set_index(results.configs["method"])
    assert set(settings) == {"model.hidden_features", "model.bounds"}
    widths = settings["model.hidden_features"]
    assert widths.drop("none").to_dict() == {
        "uniform, model.hidden_features=64": 64,
        "uniform, model.hidden_features=128": 128,
    }
    assert math.isnan(widths["none"])


def test_evaluations_are_a_value_a_row(folder) -> None:
    results = load_runs(folder)
    assert len(results.evaluations) == 5 * 9 * 2 * 4 * 2
    run = next(r for r in results.found if (r.scene, r.method, r.seed) == ("mirror", "uniform", 1))
    rows = results.evaluations.query(
        "scene == 'mirror' and method == 'uniform' and seed == 1 and set == 'hard' "
        "and metric == 'dssim' and statistic == 'worst5'"
    )
    assert rows["value"].tolist() == run.history["hard_dssim_worst5"].tolist()
    assert rows["run_seconds"].tolist() == run.history["run_seconds"].tolist()


@pytest.mark.parametrize("metric", FURTHER)
def test_further_metrics_are_there_where_they_were_measured(folder, metric: str) -> None:
    for file in folder.glob("mirror/*/seed=1/metrics.csv"):
        table = pd.read_csv(file)
        table[f"hard_{metric}"] = -0.125 * table["step"]
        table.to_csv(file, index=False)
    found = load_runs(folder).evaluations.query(f"metric == {metric!r}").dropna()
    assert set(zip(found["scene"], found["seed"], strict=True)) == {("mirror", 1)}
    assert set(found["set"]) == {"hard"}
    assert set(found["statistic"]) == {"mean"}
    assert (found["value"] == -0.125 * found["step"]).all()


def test_frames_are_a_value_a_row(folder) -> None:
    results = load_runs(folder)
    run = next(r for r in results.found if (r.scene, r.method, r.seed) == ("mirror", "uniform", 1))
    rows = results.frames.query(
        "scene == 'mirror' and method == 'uniform' and seed == 1 and set == 'uniform' "
        "and frame == 3 and metric == 'mae'"
    )
    (frame,) = (f for f in run.result["frames"] if (f["set"], f["index"]) == ("uniform", 3))
    assert rows["value"].tolist() == [frame["mae"]]
    assert len(results.frames) == 5 * 2 * 5 * 4


def test_steps_are_read_where_there_are_any(folder) -> None:
    (with_steps,) = folder.glob("chess/*/seed=0")
    table = pd.DataFrame({"step": [1, 2], "run_seconds": [0.1, 0.2], "loss": [0.5, 0.25]})
    table.to_csv(with_steps / "steps.csv", index=False)
    steps = load_runs(folder).steps
    logged = ["scene", "method", "seed", "folder", *table]
    assert steps.drop(columns=logged).isna().all(axis=None)  # what a run did not log
    assert steps[logged].values.tolist() == [
        ["chess", "uniform", 0, str(with_steps), 1, 0.1, 0.5],
        ["chess", "uniform", 0, str(with_steps), 2, 0.2, 0.25],
    ]
    (with_steps / "steps.csv").unlink()
    assert load_runs(folder).steps.columns.tolist() == ["scene", "method", "seed", "folder"]


def test_runs_of_one_scene_method_and_seed_are_told_apart_by_their_folders(
    makers_below, tmp_path
) -> None:
    """Two sweeps with the same methods and seeds, the second with a tenth of the errors."""
    ends = {}
    for sweep, quality in (("small", 1.0), ("small-model-clock", 10.0)):
        run = makers_below(tmp_path / sweep)[0](method="uniform", quality=quality)
        pd.DataFrame({"step": [1], "run_seconds": [0.1], "loss": [quality]}).to_csv(
            run / "steps.csv", index=False
        )
        last = pd.read_csv(run / "metrics.csv").iloc[-1]
        frame = json.loads((run / "result.json").read_text())["frames"][0]
        ends[str(run)] = last["hard_mape"], frame["mape"], quality
    makers_below(tmp_path / "small")[0](method="uniform", seed=1)
    results = load_runs(tmp_path)
    found = {
        folder: (
            results.evaluations.query(f"folder == {folder!r} and {HARD_MAPE}")["value"].iloc[-1],
            results.frames.query(f"folder == {folder!r} and metric == 'mape'")["value"].iloc[0],
            results.steps.query(f"folder == {folder!r}")["loss"].item(),
        )
        for folder in ends
    }
    assert found == ends
    assert results.runs.columns.tolist().count("folder") == 1
    (warning,) = results.warnings
    assert all(folder in warning for folder in ends)
    assert "mirror, uniform, seed 0" in warning


def test_what_was_left_out_is_known(folder, make_run) -> None:
    (make_run(seed=7) / "result.json").unlink()
    (warning,) = load_runs(folder).warnings
    assert "unfinished" in warning


def test_a_folder_without_runs_is_an_error(tmp_path) -> None:
    with pytest.raises(ValueError, match="no finished run"):
        load_runs(tmp_path)


def test_the_example_answers_its_questions(folder) -> None:
    errors, seconds, hardest = answers(folder).split("\n\n")[-3:]
    results = load_runs(folder)
    ends = {
        method: [r.history["hard_mape"].iloc[-1] for r in results.found if r.method == method]
        for method in ("uniform", "active_exploration")
    }
    assert max(ends["active_exploration"]) < min(ends["uniform"][:2])
    (line,) = (line for line in seconds.splitlines() if "active_exploration" in line)
    assert float(line.split()[-2]) < 240
    assert "mirror" in errors
    frames = results.frames.query("scene == 'mirror' and set == 'hard' and metric == 'mape'")
    best = frames.groupby(["frame", "method"])["value"].mean().unstack().min(axis=1)
    top = {str(frame) for frame in best.nlargest(3).index}
    rows = [line.split() for line in hardest.splitlines() if line.endswith("active_exploration")]
    assert {row[-4] for row in rows} == top


def test_path_tracing_does_not_set_the_time_that_methods_are_compared_at(folder, make_run) -> None:
    """It takes no training; all others would be compared by their first evaluation."""
    without = answers(folder)
    file = make_run(method="path_tracing") / "metrics.csv"
    pd.read_csv(file).tail(1).assign(run_seconds=0.0).to_csv(file, index=False)
    traced = answers(folder)
    assert "path_tracing" in traced
    parts = (answer.split("\n\n")[-3:-1] for answer in (traced, without))
    for found, expected in zip(*parts, strict=True):
        kept = [line.split() for line in found.splitlines() if "path_tracing" not in line]
        assert kept == [line.split() for line in expected.splitlines()]


def answers(folder: Path) -> str:
    answer = subprocess.run(
        [sys.executable, "-W", "error", "-m", "analysis.examples.questions", str(folder)],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def test_importing_the_library_loads_nothing_heavy() -> None:
    code = (
        "import sys, analysis; "
        "print([m for m in ('torch', 'mitsuba', 'ngi', 'matplotlib') if m in sys.modules])"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=REPOSITORY
    )
    assert answer.stdout.strip() == "[]", answer.stderr


def test_the_steps_that_a_method_had_no_time_for(make_method, tmp_path) -> None:
    """One method is the baseline with every step a quarter slower, one with twice the steps, and
    one 10 % worse.
    """

    def of(steps):
        return lambda result: result.update(steps=steps)

    for seed in range(2):
        make_method("uniform", seed=seed, change=of(800))
        slower = make_method("active_exploration", seed=seed, change=of(600)) / "metrics.csv"
        rows = pd.read_csv(slower)
        rows["run_seconds"] *= 1.25
        rows.query("run_seconds <= 240").to_csv(slower, index=False)
        worse = make_method("metropolis", seed=seed, error=0.11, change=of(800)) / "metrics.csv"
        rows = pd.read_csv(worse)
        rows.assign(hard_relmse=-1e-5, hard_tail=7.0).to_csv(worse, index=False)
        faster = make_method("no_preconditioning", seed=seed, rate=0.02, change=of(1600))
        rows = pd.read_csv(faster / "metrics.csv")
        steps = [*2 * rows["step"][:-1], 1600]
        rows.assign(step=steps).to_csv(faster / "metrics.csv", index=False)
    answer = subprocess.run(
        [sys.executable, "-W", "error", "-m", "analysis.examples.same_steps", tmp_path / "runs"],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
    )
    assert answer.returncode == 0, answer.stderr
    _, slower, time, steps, worse, *lines = answer.stdout.splitlines()
    *both, faster, _, as_many = lines
    assert slower == "active_exploration: 2 runs, 0.750 of the steps"
    expected = (1 + 7 * math.exp(-1.8)) / (1 + 7 * math.exp(-2.4))
    assert float(time.split()[4]) == pytest.approx(100 * (expected - 1), abs=0.1)
    assert steps.split()[4] == "+0.0"
    assert worse == "metropolis: 2 runs, 1.000 of the steps"
    assert [line.split()[4] for line in both] == ["+10.0", "+10.0"]
    assert faster == "no_preconditioning: 2 runs, 2.000 of the steps"
    assert as_many.split()[4] == "+0.0"


def test_two_methods_are_compared_pair_by_pair(folder) -> None:
    results = load_runs(folder)
    table = results.compared("active_exploration", "uniform")
    assert set(table["scene"]) == {"mirror"}  # chess has no run of the other
    values = results.frames.query("scene == 'mirror' and set == 'hard'")
    values = values.pivot_table("value", ["metric", "frame", "seed"], "method")
    ratios = values["active_exploration"] / values["uniform"]
    for metric, of_it in (("together", ratios), ("mape", ratios["mape"])):
        row = table.query(f"set == 'hard' and metric == '{metric}' and statistic == 'mean'")
        assert row["difference"].item() == pytest.approx(100 * (gmean(of_it) - 1))
        assert row["low"].item() <= row["difference"].item() <= row["high"].item()
        assert (row["seeds"].item(), row["frames"].item()) == (2, len(ratios["mape"]) / 2)
    assert set(table.query("metric == 'mape'")["statistic"]) == {"mean", "worst5"}


def test_a_comparison_over_scenes_counts_each_scene_once(folder, make_run) -> None:
    make_run(scene="chess", method="active_exploration", quality=2.0)
    table = load_runs(folder).compared("active_exploration", "uniform")
    table = table.query("set == 'hard' and metric == 'mape' and statistic == 'mean'")
    of_scenes = table.set_index("scene")["difference"]
    assert list(of_scenes.index) == ["chess", "mirror", "all scenes"]
    each = 1 + of_scenes[["chess", "mirror"]] / 100
    assert of_scenes["all scenes"] == pytest.approx(100 * (gmean(each) - 1))


def test_methods_that_cannot_be_compared_are_refused(folder, make_run) -> None:
    with pytest.raises(ValueError, match="no scene and seed in common; there are active_expl"):
        load_runs(folder).compared("active_exploration", "unifrom")
    make_run(seed=1, method="uniform", name="again")
    with pytest.raises(ValueError, match=r"the same method \(uniform\) with the same seed \(1\)"):
        load_runs(folder).compared("active_exploration", "uniform")
