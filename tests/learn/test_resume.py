import json
import time
from pathlib import Path

import pandas as pd
import pytest
import torch

from ngi.clock.phase_clock import PHASES
from ngi.render.pilot_advice import pilot_advice
from tests.learn.command_line import BRIEF, run, start
from tests.learn.comparison import assert_same, final_state

COMMAND = ("budget.steps=90", "run.checkpoint_steps=7")


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken")
    status, output = run(folder, *COMMAND, "run.folder=run")
    assert status == 0, output
    return folder / "run"


def kill_after_checkpoint(folder: Path, *options: str) -> None:
    output = folder / "output"
    process = start(folder, *options, output=output, base=())
    deadline = time.monotonic() + 120
    while not (folder / "run" / "last.ckpt").exists():
        assert process.is_alive(), output.read_text()
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.kill()
    process.join()


def test_real_renders_with_growing_resolution_resume_bit_for_bit(tmp_path: Path) -> None:
    options = (
        "budget=smoke",
        "scene=mirror",
        "budget.steps=24",
        "resolution=growing",
        "resolution.start=40",
        "resolution.every=6",
        "run.checkpoint_steps=5",
        "run.folder=run",
        f"run.references={tmp_path / 'references'}",
    )
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert run(tmp_path / "a", *options, base=())[0] == 0
    kill_after_checkpoint(tmp_path / "b", *options)
    assert not (tmp_path / "b" / "run" / "result.json").exists(), "it was not killed in time"
    assert run(tmp_path / "b", *options, base=())[0] == 0
    assert_same(final_state(tmp_path / "a" / "run"), final_state(tmp_path / "b" / "run"))


def test_a_budget_in_seconds_is_run_time_and_is_not_overdrawn_on_resume(tmp_path: Path) -> None:
    status, output = run(tmp_path, "run.folder=run", base=BRIEF)
    assert status == 0, output
    folder = tmp_path / "run"
    result = json.loads((folder / "result.json").read_text())
    assert 2 <= result["run_seconds"] < 3
    named = sum(result["seconds"][phase] for phase in PHASES)
    assert named == pytest.approx(result["run_seconds"], abs=0.01)
    assert result["seconds"]["evaluate"] > 0
    steps, metrics = (pd.read_csv(folder / name)["step"] for name in ("steps.csv", "metrics.csv"))
    assert result["steps"] == steps.iloc[-1] == metrics.iloc[-1]
    assert metrics.is_unique
    assert len(metrics) == 2

    (folder / "result.json").unlink()  # killed after its last step, before its result
    status, output = run(tmp_path, "run.folder=run", base=BRIEF)
    assert status == 0, output
    again = json.loads((folder / "result.json").read_text())
    assert again["steps"] == result["steps"]
    assert again["metrics"] == result["metrics"]
    assert pd.read_csv(folder / "metrics.csv")["step"].tolist() == metrics.tolist()


def test_a_finished_run_is_not_run_again(tmp_path: Path, unbroken: Path) -> None:
    before = {p: p.stat().st_mtime_ns for p in unbroken.glob("*.*")}
    status, output = run(tmp_path, *COMMAND, f"run.folder={unbroken}")
    assert status == 0, output
    assert "already finished" in output
    result = json.loads((unbroken / "result.json").read_text())
    assert pilot_advice(result["new_worst_share"]) in output
    assert pd.read_csv(unbroken / "metrics.csv")["new_worst_share"].between(0.05, 1).all()
    after = {p: p.stat().st_mtime_ns for p in unbroken.glob("*.*")}
    touched = {p.name for p in before if before[p] != after[p]}
    assert touched <= {"settings.json", ".lock", "train.log"}


def test_another_seed_gives_another_run(tmp_path: Path, unbroken: Path) -> None:
    status, output = run(tmp_path, *COMMAND, "run.folder=run", "seed=1")
    assert status == 0, output
    ours, theirs = final_state(tmp_path / "run"), final_state(unbroken)
    key = next(iter(theirs["state_dict"]))
    assert not torch.equal(ours["state_dict"][key], theirs["state_dict"][key])


def test_the_log_has_one_row_per_step(unbroken: Path) -> None:
    steps = pd.read_csv(unbroken / "steps.csv")
    assert steps["step"].tolist() == list(range(1, 91))
    always = ["reuse_probability", "store_size", "store_mean_age", "loss", "resolution"]
    assert steps[always].notna().all().all()
    generated = steps["generated_batches"].diff() > 0
    assert steps.loc[generated, "acceptance_rate"].notna().all()
    assert steps.loc[steps["step"] > 5, ["loss_new", "loss_existing"]].notna().all().all()
