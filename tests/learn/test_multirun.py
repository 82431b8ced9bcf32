import json
from pathlib import Path
from statistics import mean

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


DEADLY = """
import os
import signal

def killed(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)

def terminated(*_, **__):
    os.kill(os.getpid(), signal.SIGTERM)
"""


@pytest.mark.parametrize(
    ("launcher", "end", "status", "said", "finished"),
    [
        ("basic", "terminated", 143, "ended by SIGTERM", "0"),
        ("submitit_local", "killed", 1, "_result.pkl has not produced any output (state: ", "0"),
        # joblib ends the processes of other runs too
        ("joblib", "killed", 1, "excessive memory usage", "0,1"),
    ],
)
def test_runs_that_were_killed_or_not_started_are_named_at_the_end(
    tmp_path: Path, launcher: str, end: str, status: int, said: str, finished: str
) -> None:
    """finished: seeds of the runs that were made before this sweep"""
    if launcher != "basic":
        plugin = launcher.partition("_")[0]
        pytest.importorskip(f"hydra_plugins.hydra_{plugin}_launcher", reason="an extra is missing")
    (tmp_path / "deadly.py").write_text(DEADLY)
    place = "run.folder='outputs/${optimizer._target_}-${seed}'"
    before, output = run(tmp_path, f"seed={finished}", place, options=("--multirun",))
    assert before == 0, output
    start = run_cold if launcher == "joblib" else run
    words = (f"optimizer._target_=torch.optim.Adam,deadly.{end}", "seed=0,1", place)
    found, output = start(tmp_path, f"hydra/launcher={launcher}", *words, options=("--multirun",))
    assert found == status, output
    assert said in output
    assert "Traceback" not in output
    killed = f"outputs/deadly.{end}-0, outputs/deadly.{end}-1"
    assert "2 runs of this sweep have not ended (killed, not started, or" in output
    assert f" on a cluster): {killed}; the same command goes on\n" in output


def test_weights_and_biases_runs_offline_and_stay_apart(tmp_path: Path) -> None:
    status, output = run(tmp_path, "tracker=wandb", "seed=0,1", options=("--multirun",))
    assert status == 0, output
    runs = sorted((tmp_path / "outputs").rglob("offline-run-*"))
    assert len(runs) == 2
    assert len({r.parents[1] for r in runs}) == 2
    assert all(any(r.glob("*.wandb")) for r in runs)


SWEEPER = """
from pathlib import Path
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper

class Optimising(BasicSweeper):
    def sweep(self, arguments):
        (jobs,) = super().sweep(arguments)
        Path("values").write_text("\\n".join(str(float(job.return_value)) for job in jobs))
"""
"""As those of Optuna, Ax and Nevergrad, it makes a number of what a job returns."""


def test_a_sweeper_that_optimises_is_given_the_error_on_hard_frames(tmp_path: Path) -> None:
    (tmp_path / "hydra_plugins").mkdir()
    (tmp_path / "hydra_plugins" / "optimising.py").write_text(SWEEPER)
    words = ("optimizer.lr=1e-3,1e-2", "run.folder='outputs/${optimizer.lr}'")
    sweeper = "hydra.sweeper._target_=hydra_plugins.optimising.Optimising"
    for _ in ("trained", "already finished"):
        status, output = run_cold(tmp_path, *words, sweeper, options=("-m",))  # it finds plugins
        assert status == 0, output
        values = [float(value) for value in (tmp_path / "values").read_text().split()]
        (tmp_path / "values").unlink()
        expected = []
        for rate in ("0.001", "0.01"):
            frames = json.loads((tmp_path / "outputs" / rate / "result.json").read_text())["frames"]
            expected.append(mean(each["mape"] for each in frames if each["set"] == "hard"))
        assert values == pytest.approx(expected)
    assert "already finished" in output
    assert values[0] != values[1]
