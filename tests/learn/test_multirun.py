import json
from pathlib import Path

import pytest

from tests.learn.command_line import run, run_cold


@pytest.mark.parametrize("launcher", ["basic", "joblib", "submitit_local"])
def test_one_failing_job_does_not_lose_the_others(tmp_path: Path, launcher: str) -> None:
    if launcher != "basic":
        plugin = launcher.partition("_")[0]
        pytest.importorskip(f"hydra_plugins.hydra_{plugin}_launcher", reason="an extra is missing")
    start = run_cold if launcher == "joblib" else run  # whose processes wait for their parent
    status, output = start(
        tmp_path, "optimizer.lr=-1,1e-3", f"hydra/launcher={launcher}", options=("--multirun",)
    )
    assert status != 0
    assert "Invalid learning rate" in output
    results = [json.loads(r.read_text()) for r in (tmp_path / "outputs").rglob("result.json")]
    assert [r["config"]["optimizer"]["lr"] for r in results] == [0.001]


def test_weights_and_biases_runs_offline_and_stay_apart(tmp_path: Path) -> None:
    status, output = run(tmp_path, "tracker=wandb", "seed=0,1", options=("--multirun",))
    assert status == 0, output
    runs = sorted((tmp_path / "outputs").rglob("offline-run-*"))
    assert len(runs) == 2
    assert len({r.parents[1] for r in runs}) == 2
    assert all(any(r.glob("*.wandb")) for r in runs)
