"""TensorBoard and MLflow hold what the run's own files hold, read back by their own readers."""

import signal
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from omegaconf import DictConfig

from ngi.learn import Interrupted, MLflow
from ngi.train import train
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED, RESUMED
from tests.learn.test_trained_longer import stop

STEPS, STOPPED = 24, 17
pytestmark = [
    *(*IGNORED, RESUMED),
    pytest.mark.filterwarnings("ignore:.*loader strategy is deprecated"),  # MLflow, of SQLAlchemy
]


def interrupted(folder: Path, *overrides: str, stopped: int = STOPPED) -> Path:
    """The folder of a run that was broken off and went on."""

    def run() -> DictConfig:
        config = configuration(folder, *overrides, "model.hidden_features=24")
        config.budget.steps = STEPS
        return config

    stop(run(), stopped)
    train(run())
    return folder / "run"


@pytest.fixture(scope="module", params=[STOPPED, 3], ids=["stopped", "before a checkpoint"])
def tensorboard(tmp_path_factory: pytest.TempPathFactory, request) -> Path:
    pytest.importorskip("tensorboard", reason="the extra tensorboard is missing")
    folder = tmp_path_factory.mktemp("tensorboard")
    return interrupted(folder, "tracker=tensorboard", stopped=request.param)


def test_tensorboard_has_every_step_once_and_every_evaluation(tensorboard: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    events = EventAccumulator(
        str(tensorboard / "tensorboard"), size_guidance={"images": 0}
    ).Reload()
    steps, metrics = (pd.read_csv(tensorboard / f"{name}.csv") for name in ("steps", "metrics"))
    for tag, table, column in (
        ("train/loss", steps, "loss"),
        ("hard/mape", metrics, "hard_mape"),
        ("best/uniform_dssim", metrics.assign(best=metrics["uniform_dssim"].cummin()), "best"),
    ):
        told = events.Scalars(tag)
        assert [event.step for event in told] == table["step"].tolist()
        np.testing.assert_allclose([event.value for event in told], table[column], rtol=1e-6)
    sheets = events.Images("comparison")
    assert [sheet.step for sheet in sheets] == metrics["step"].tolist()
    assert sheets[0].encoded_image_string.startswith(b"\x89PNG")
    assert "error_maps/hard_0" in events.Tags()["images"]
    assert len(list((tensorboard / "tensorboard").glob("events.*"))) >= 2


def test_tensorboard_lists_the_configuration(tensorboard: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
    from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

    events = EventAccumulator(str(tensorboard / "tensorboard")).Reload()
    content = events.SummaryMetadata("_hparams_/session_start_info").plugin_data.content
    told = HParamsPluginData.FromString(content).session_start_info.hparams
    assert told["sampler"].string_value == "mcmc_loss_step"
    assert told["settings/model/hidden_features"].number_value == 24


@pytest.fixture(scope="module")
def mlflow(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mlflow", reason="the extra mlflow is missing")
    folder = tmp_path_factory.mktemp("mlflow")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)  # artifacts go to ./mlruns
        uri = f"tracker.uri='sqlite:///{folder}/mlflow.db'"
        return interrupted(folder, "tracker=mlflow", "tracker.every=4", uri)


def test_mlflow_has_one_run_with_all_that_is_passed_on(mlflow: Path) -> None:
    from mlflow import MlflowClient

    client = MlflowClient(f"sqlite:///{mlflow.parent}/mlflow.db")
    experiment = client.get_experiment_by_name("neural-global-illumination")
    (run,) = client.search_runs([experiment.experiment_id])
    assert (run.info.status, run.data.tags["failure"]) == ("FINISHED", "")
    assert run.data.params["sampler"] == "mcmc_loss_step"
    assert run.data.params["settings/model/hidden_features"] == "24"
    assert run.data.tags["group"] == "steps"
    assert run.data.tags["job_type"].startswith("mcmc_loss_step, budget.steps=40, ")
    steps, metrics = (pd.read_csv(mlflow / f"{name}.csv") for name in ("steps", "metrics"))
    for key, table, column in (
        ("train/loss", steps[steps["step"] % 4 == 0], "loss"),
        ("hard/mape", metrics, "hard_mape"),
    ):
        told = client.get_metric_history(run.info.run_id, key)
        assert [point.step for point in told] == table["step"].tolist()
        np.testing.assert_allclose([p.value for p in told], table[column], rtol=1e-12)
    kept = {file.path for file in client.list_artifacts(run.info.run_id)}
    assert {"result.json", "metrics.csv", "images"} <= kept
    pictures = [file.path for file in client.list_artifacts(run.info.run_id, "images")]
    for step in metrics["step"]:
        for name in ("comparison", "error_maps~hard_0"):
            of_step = [p for p in pictures if p.startswith(f"images/{name}+step+{step}+")]
            assert len(of_step) == 2, "and a thumbnail"


@pytest.mark.parametrize(
    ("failure", "status", "reason"),
    [
        (RuntimeError("power cut"), "FAILED", "RuntimeError: power cut"),
        (Interrupted(signal.SIGTERM), "KILLED", "interrupted by SIGTERM"),
    ],
)
def test_mlflow_is_told_why_a_run_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException, status, reason
) -> None:
    mlflow = pytest.importorskip("mlflow", reason="the extra mlflow is missing")
    monkeypatch.chdir(tmp_path)
    uri = f"sqlite:///{tmp_path}/mlflow.db"
    label = dict.fromkeys(("scene", "method", "sampler", "budget", "overrides", "seed"), "none")
    tracker = MLflow(uri=uri, experiment="e", options={}, every=1)
    tracker.start(folder=tmp_path, settings={"budget": {"clock": "wall"}}, label=label)
    tracker.finish(failure)
    client = mlflow.MlflowClient(uri)
    (run,) = client.search_runs([client.get_experiment_by_name("e").experiment_id])
    assert (run.info.status, run.data.tags["failure"]) == (status, reason)


def test_a_database_that_cannot_be_opened_stops_no_run(tmp_path: Path, caplog) -> None:
    pytest.importorskip("mlflow", reason="the extra mlflow is missing")
    uri = f"tracker.uri='sqlite:///{tmp_path}/nowhere/mlflow.db'"
    config = configuration(tmp_path, "tracker=mlflow", uri, "model.hidden_features=24")
    config.budget.steps = 6
    (tmp_path / "nowhere").touch()
    assert train(config)["steps"] == 6
    assert caplog.text.count("MLflow failed (") == 1
