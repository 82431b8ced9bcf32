"""A run as Weights & Biases keeps it offline: what its users look for is there, and true."""

import json
import os
from collections import defaultdict
from itertools import accumulate
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from omegaconf import DictConfig
from PIL import Image

from ngi.config.configuration import composed
from ngi.train import train
from tests.docs.pages import ROOT, blocks
from tests.learn import forked
from tests.learn.forked import configuration
from tests.learn.lightning_warnings import IGNORED, RESUMED
from tests.learn.test_trained_longer import stop
from tests.learn.wandb_files import Record, history, of_kind, offline_files, records, summary

pytestmark = [*IGNORED, RESUMED]

STEPS, STOPPED, SAVED = 24, 17, 14
OVERRIDES = ("tracker=wandb", "tracker.network=true", "model.hidden_features=24", "seed=3")


def run(folder: Path) -> DictConfig:
    config = configuration(folder, *OVERRIDES)
    config.budget.steps = STEPS
    return config


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a run that was broken off at step 17, and went on from the checkpoint of step 14."""
    folder = tmp_path_factory.mktemp("tracked")
    stop(run(folder), STOPPED)
    train(run(folder))
    return folder / "run"


@pytest.fixture(scope="module")
def parts(folder: Path) -> list[list[Record]]:
    return [records(file) for file in offline_files(folder)]


@pytest.fixture(scope="module")
def rows(parts: list[list[Record]]) -> dict[int, Record]:
    """Of both parts, by step; of what was done twice, the second."""
    found: dict[int, Record] = defaultdict(dict)
    for part in parts:
        for row in history(part):
            found[row["step"]].update(row)
    return found


def test_it_is_one_run_across_the_interruption(folder: Path, parts: list[list[Record]]) -> None:
    told = [next(of_kind(part, "run")) for part in parts]
    (kept,) = json.loads((folder / "tracker.json").read_text()).values()
    assert [run["run_id"] for run in told] == [kept] * 2
    assert all(run["resume"] for run in told)
    assert [next(of_kind(part, "exit")).get("exit_code", 0) for part in parts] == [1, 0]
    told = [summary(part)["failure"] for part in parts]
    assert told == ["RuntimeError: power cut", ""], "the second hides the first"


def test_it_has_its_place(parts: list[list[Record]]) -> None:
    told = next(of_kind(parts[0], "run"))
    assert told["run_group"] == "steps"
    assert told["job_type"].startswith("mcmc_loss_step, budget.steps=40, ")
    assert told["display_name"] == f"sphere-caustic/{told['job_type']}/3"
    assert {"scene=sphere-caustic", "seed=3"} <= {*told["tags"]}


def test_every_option_and_value_can_be_filtered_by(parts: list[list[Record]]) -> None:
    found = next(of_kind(parts[0], "run"))["config"]["update"]
    flat = {key: value for key, value in found.items() if not isinstance(value, dict)}
    assert flat["sampler"] == "mcmc_loss_step"
    assert (flat["optimizer"], flat["trainer"], flat["seed"]) == ("adam", "fp32", 3)
    assert {path.name for path in (ROOT / "conf").iterdir() if path.is_dir()} - {"hydra"} <= {
        *found
    }
    assert found["settings"]["model"]["hidden_features"] == 24
    assert not [key for key in found if "/" in key]


def test_errors_have_run_time_as_axis_and_losses_steps(parts: list[list[Record]]) -> None:
    axes = {
        m.get("glob_name", m.get("name")): m.get("step_metric") for m in of_kind(parts[0], "metric")
    }
    assert axes == {
        "step": None,
        "run_seconds": "step",
        "train/*": "step",
        "run/*": "step",
        **dict.fromkeys(("hard/*", "uniform/*", "best/*"), "run_seconds"),
    }


def test_every_step_is_there(folder: Path, rows: dict[int, Record]) -> None:
    steps = pd.read_csv(folder / "steps.csv")
    assert [*sorted(rows)] == steps["step"].tolist() == [*range(1, STEPS + 1)]
    for name in ("loss", "gradient_norm", "reuse_probability"):
        told = [rows[step][f"train/{name}"] for step in steps["step"]]
        np.testing.assert_allclose(told, steps[name], rtol=1e-12)
    alone = steps[~steps["step"].isin(pd.read_csv(folder / "metrics.csv")["step"])]
    told = [rows[step]["run_seconds"] for step in alone["step"]]
    assert told == pytest.approx(alone["run_seconds"].tolist())


def test_every_evaluation_is_there_with_the_best_so_far(
    folder: Path, parts: list[list[Record]], rows: dict[int, Record]
) -> None:
    metrics = pd.read_csv(folder / "metrics.csv")
    assert len(metrics) == 3
    assert metrics["step"].iloc[0] < SAVED, "one of them was before the interruption"
    for column in ("hard_mape", "uniform_dssim_worst5"):
        section, _, name = column.partition("_")
        told = [rows[step][f"{section}/{name}"] for step in metrics["step"]]
        np.testing.assert_allclose(told, metrics[column], rtol=1e-12)
        best = [rows[step][f"best/{column}"] for step in metrics["step"]]
        np.testing.assert_allclose(best, [*accumulate(metrics[column], min)], rtol=1e-12)
        last = summary(parts[1])
        assert last[f"{section}/{name}"] == pytest.approx(metrics[column].iloc[-1])
        assert last[f"best/{column}"] == pytest.approx(metrics[column].min())
    assert rows[STEPS]["run/patches_traced"] == metrics["patches_traced"].iloc[-1]


def pixels(file: Path) -> np.ndarray:
    with Image.open(file) as picture:
        return np.asarray(picture)


def test_every_evaluation_has_its_pictures(folder: Path, rows: dict[int, Record]) -> None:
    evaluated = pd.read_csv(folder / "metrics.csv")["step"]
    assert [step for step in sorted(rows) if "comparison.path" in rows[step]] == evaluated.tolist()
    hard = sorted(file.stem for file in (folder / "pictures").glob("hard_??.png"))
    last = rows[STEPS]
    assert last["error_maps.captions"] == [f"hard {int(name[-2:])}" for name in hard]
    files = offline_files(folder)[1].parent / "files"
    for told, name in zip(last["error_maps.filenames"], hard, strict=True):
        ours = pixels(folder / "pictures" / f"{name}_error.png")
        np.testing.assert_array_equal(pixels(files / told), ours)
    sheet = pixels(files / last["comparison.path"])
    height, width, _ = pixels(folder / "pictures" / f"{hard[0]}.png").shape
    assert sheet.shape == (len(hard) * height, width, 3)


def test_the_result_and_the_network_are_artifacts(folder: Path, parts: list[list[Record]]) -> None:
    found = {artifact["type"]: artifact for artifact in of_kind(parts[1], "artifact")}
    files = {
        kind: {file["path"]: int(file.get("size", 0)) for file in artifact["manifest"]["contents"]}
        for kind, artifact in found.items()
    }
    assert {"result.json", "metrics.csv", "steps.csv"} <= files["result"].keys()
    assert {"last.ckpt", "settings.json", "result.json"} <= files["model"].keys()
    for sizes in files.values():
        assert sizes == {name: (folder / name).stat().st_size for name in sizes}
    assert not [*of_kind(parts[0], "artifact")], "nothing of what was broken off"


def test_a_finished_run_is_not_told_twice(folder: Path) -> None:
    train(run(folder.parent))
    assert len(offline_files(folder)) == 2


def as_by_an_agent() -> None:
    os.environ.update(WANDB_SWEEP_ID="sweep1", WANDB_RUN_ID="agent1")


def test_an_agent_that_asks_for_a_finished_run_is_told_its_errors(folder: Path) -> None:
    status, output = forked.run(run(folder.parent), folder.parent / "output", first=as_by_an_agent)
    assert status == 0, output
    told = records(offline_files(folder)[-1])
    assert next(of_kind(told, "run"))["run_id"] == "agent1"
    assert next(of_kind(told, "run"))["sweep_id"] == "sweep1"
    expected = pd.read_csv(folder / "metrics.csv")["hard_mape"].iloc[-1]
    assert summary(told)["hard/mape"] == pytest.approx(expected)
    assert "Ignoring" not in output


def test_the_sweep_of_the_documentation_is_one_that_agents_can_start(folder: Path) -> None:
    from wandb.sdk.launch.sweeps.utils import create_sweep_command, create_sweep_command_args

    (block,) = [b for b in blocks(ROOT / "docs" / "guide" / "wandb.md") if b.language == "yaml"]
    sweep = yaml.safe_load(block.text)
    first = {
        name: {"value": values.get("value", values.get("values", [values.get("min")])[0])}
        if "value" not in values
        else {"value": values["value"]}
        for name, values in sweep["parameters"].items()
    }
    filled = create_sweep_command_args({"args": first})
    words: list[str] = []
    for word in create_sweep_command(list(sweep["command"])):
        words += filled.get(word[2:-1], ["/usr/bin/env"]) if word.startswith("${") else [word]
    assert words[:3] == ["/usr/bin/env", "ngi", "train"]
    config = composed(*words[3:])
    assert (config.tracker._target_, config.tracker.mode) == (
        "ngi.learn.WeightsAndBiases",
        "online",
    )
    for name, chosen in first.items():
        if "." in name:
            assert str(config[name.split(".")[0]][name.split(".")[1]]) == str(chosen["value"])
    section, _, name = sweep["metric"]["name"].partition("/")
    assert f"{section}_{name}" in pd.read_csv(folder / "metrics.csv")
