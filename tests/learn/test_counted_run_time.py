"""Whole runs by the model clock: the same curve however slow the machine is, and where it stops."""

import json
import time
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import torch
from omegaconf import DictConfig
from torch import Tensor

from ngi.config.build import run_components
from ngi.learn import CostFile, PatchSamples, TrainingStream
from ngi.machine.memory import COLUMNS
from ngi.render import AnalyticRenderer, PatchJob
from ngi.studies import costs as costs_command
from ngi.train import train
from tests.learn.command_line import SIZE
from tests.learn.comparison import assert_same
from tests.learn.composition import run_config
from tests.learn.noted_rates import noted_rates

pytestmark = [  # as ngi.learn.lightning_api has them, which pytest resets
    pytest.mark.filterwarnings(f"ignore:.*{words}")
    for words in ("LeafSpec", "dataloader is not resumable")
]

SECONDS = {
    "training": {"reuse": 0.01, "train": 0.1, "other": 0.003},
    "exploring": {"explore": 0.002, "reuse": 0.001},
    "rendering": {"render": 0.7},
    "scoring": {"score": 0.3},
}
"""Of a step, by component and phase."""


def model_clock(folder: Path, *overrides: str) -> DictConfig:
    """A run of 15 counted seconds."""
    return run_config(
        *SIZE,
        "budget=seconds",
        "budget.seconds=15",
        "budget.clock=model",
        f"budget.costs={folder / 'costs.json'}",
        f"run.references={folder / 'references'}",
        "evaluation.count=5",
        f"run.folder={folder / 'run'}",
        *overrides,
    )


def with_costs(config: DictConfig) -> DictConfig:
    """The same, after its costs were put into the file."""
    renderer = AnalyticRenderer(dimensions=3, patch_size=config.renderer.patch_size)
    for part in run_components(config, renderer=renderer):
        values = {phase: [seconds] for phase, seconds in SECONDS[part.name].items()}
        CostFile(Path(config.budget.costs)).add(part, values, measured_by={})
    return config


def metrics(folder: Path) -> pd.DataFrame:
    return pd.read_csv(folder / "run" / "metrics.csv").drop(columns=["wall_seconds", *COLUMNS])


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("quick")
    return folder, train(with_costs(model_clock(folder)))


def test_run_time_is_counted(quick: tuple[Path, dict[str, Any]]) -> None:
    folder, result = quick
    steps, generated, scored = (
        result[key] for key in ("steps", "generated_batches", "scored_batches")
    )
    assert scored == generated - 1, "the chains' first states have nothing to be compared with"
    expected = steps * 0.113 + generated * 0.703 + scored * 0.3
    assert result["clock"] == "model"
    assert result["run_seconds"] == pytest.approx(expected, rel=1e-12)
    assert 15 <= result["run_seconds"] < 15 + 0.113 + 0.703 + 0.3
    assert result["seconds"]["score"] == pytest.approx(scored * 0.3)
    assert result["seconds"]["evaluate"] == 0
    assert result["wall_seconds_by_phase"]["evaluate"] > 0
    assert 0 < result["wall_seconds"] < sum(result["wall_seconds_by_phase"].values())
    assert result["config"]["costs"] == SECONDS
    assert "costs" not in result["config"]["budget"]
    assert result["config"]["budget"]["clock"] == "model"
    rows = pd.read_csv(folder / "run" / "metrics.csv")
    assert len(rows) == 5
    assert rows["run_seconds"].tolist()[:4] == pytest.approx([3, 6, 9, 12], abs=1.2)
    assert pd.read_csv(folder / "run" / "steps.csv")["run_seconds"].iloc[-1] == pytest.approx(
        expected, abs=1e-4
    )


def test_a_slow_machine_gives_the_same_curve(
    tmp_path: Path, quick: tuple[Path, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    render = AnalyticRenderer.render_patches

    def slow(*arguments: Any, **options: Any) -> Any:
        time.sleep(0.05)
        return render(*arguments, **options)

    monkeypatch.setattr(AnalyticRenderer, "render_patches", slow)
    result = train(with_costs(model_clock(tmp_path)))
    assert result["wall_seconds_by_phase"]["render"] >= 0.05 * result["generated_batches"]
    pd.testing.assert_frame_equal(metrics(tmp_path), metrics(quick[0]), check_exact=True)


LEARNER = (
    "optimizer=muon",
    "schedule=warmup_stable_decay",
    "schedule.warmup_steps=5",
    "averaging=exponential",
)


@pytest.mark.parametrize("overrides", [(), LEARNER])
def test_a_run_broken_off_ends_like_an_unbroken_one(
    tmp_path: Path,
    quick: tuple[Path, dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    overrides: tuple[str, ...],
) -> None:
    whole = quick[0]
    if overrides:
        whole = tmp_path / "whole"
        train(with_costs(model_clock(whole, *overrides)))
    log_row = TrainingStream.log_row

    def failing(stream: TrainingStream) -> Any:
        if stream.counters.iteration == 31:
            raise RuntimeError("power cut")
        return log_row(stream)

    config = with_costs(model_clock(tmp_path, "run.checkpoint_steps=7", *overrides))
    with monkeypatch.context() as patch:
        patch.setattr(TrainingStream, "log_row", failing)
        with pytest.raises(RuntimeError, match="power cut"):
            train(config)
    checkpoint = torch.load(tmp_path / "run" / "last.ckpt", weights_only=True)
    assert checkpoint["global_step"] >= 28
    result = train(config)
    pd.testing.assert_frame_equal(metrics(tmp_path), metrics(whole), check_exact=True)
    ours, theirs = (
        torch.load(folder / "run" / "last.ckpt", weights_only=True)["state_dict"]
        for folder in (tmp_path, whole)
    )
    assert_same(ours, theirs)
    first = checkpoint["callbacks"]["StepLog"]["seconds"]
    assert result["wall_seconds_by_phase"]["train"] > first["train"] > 0


def test_costs_decide_what_a_run_is_and_their_path_does_not(
    tmp_path: Path, quick: tuple[Path, dict[str, Any]]
) -> None:
    folder, result = quick
    same = with_costs(model_clock(tmp_path, f"run.folder={folder / 'run'}"))
    assert train(same) == result, "it is finished"
    file = Path(same.budget.costs)
    file.write_text(file.read_text().replace("0.7", "0.5"))
    with pytest.raises(ValueError, match=r"costs\.rendering\.render: 0\.7 there, 0\.5 now"):
        train(same)


def test_what_is_not_measured_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"costs\.json lacks 'training-.*`ngi costs`"):
        train(model_clock(tmp_path))
    assert not (tmp_path / "run").exists()


def test_batches_must_not_depend_on_speed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"reuse\.when_late: 'reuse'.*budget\.clock=model"):
        train(with_costs(model_clock(tmp_path, "reuse.when_late=reuse")))


def test_the_wall_clock_is_the_run_clock_by_default(tmp_path: Path) -> None:
    result = train(
        model_clock(tmp_path, "budget.clock=wall", "budget.steps=3", "evaluation.count=1")
    )
    assert result["clock"] == "wall"
    assert result["config"]["costs"] is None
    assert result["seconds"] == result["wall_seconds_by_phase"]
    assert result["wall_seconds"] == result["run_seconds"]
    assert result["steps"] == 3


def test_the_command_measures_what_is_missing_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(costs_command, "SECONDS", 0.0)
    monkeypatch.setattr(costs_command, "_looked_at", set())
    costs_command.measure(model_clock(tmp_path, "sampler=uniform", "sampler.chains=4"))
    file = tmp_path / "costs.json"
    first = json.loads(file.read_text())["components"]
    assert [entry["component"] for entry in first.values()] == [
        "exploring",
        "rendering",
        "training",
    ]
    costs_command.measure(model_clock(tmp_path))
    entries = json.loads(file.read_text())["components"]
    assert first.items() <= entries.items()
    assert [entry["component"] for entry in entries.values()] == [
        "exploring", "rendering", "scoring", "training",
    ]  # fmt: skip
    for entry in entries.values():
        assert entry["samples"] >= 3
        assert entry["machine"]["processor"]
        for phase, seconds in entry["seconds"].items():
            lower, upper = entry["quartiles"][phase]
            assert 0 <= lower <= seconds <= upper
    assert sum(part["seconds"].get("train", 0) for part in entries.values()) > 0
    table = capsys.readouterr().out
    assert table.count("new") == 6 + 1

    content = file.read_bytes()
    costs_command.measure(model_clock(tmp_path, "optimizer.lr=0.5"))
    costs_command.measure(model_clock(tmp_path, "seed=3"))
    assert file.read_bytes() == content
    assert capsys.readouterr().out.count("scoring") == 1, "another seed is not looked at again"
    assert not (tmp_path / "run").exists()
    assert train(model_clock(tmp_path, "budget.seconds=0.001", "evaluation.count=1"))["finished"]


def test_the_last_steps_are_on_stored_patches_and_the_rate_falls_during_these_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """These are a quarter of the steps, and far less of the seconds."""
    rates = noted_rates(torch.optim.Adam, monkeypatch)
    config = with_costs(
        model_clock(
            tmp_path,
            *("reuse.policy._target_=ngi.reuse.FixedProbability", "+reuse.policy.probability=0.5"),
            *("~reuse.policy.beta", "~reuse.policy.ema_coefficient"),
            *("+reuse.policy.stored_alone=0.25", "evaluation.count=1"),
            *("schedule=warmup_stable_decay", "schedule.warmup_steps=0"),
            "schedule.decay_share=0.25",
        )
    )
    result = train(config)
    generated = pd.read_csv(tmp_path / "run" / "steps.csv")["generated_batches"]
    steps, new = result["steps"], int(generated.searchsorted(generated.iloc[-1]))
    of_a_batch = 1.003 / 0.113  # in steps
    assert new < 0.75 * steps <= new + 2 + of_a_batch, "as many are new as leave time for the rest"
    assert result["run_seconds"] == pytest.approx(15, abs=0.113)
    whole = rates.count(rates[0])
    assert whole == pytest.approx(0.75 * steps, abs=1.1)
    assert rates[:whole] == [rates[0]] * whole
    assert rates[-1] < 0.1 * rates[0]


def test_the_command_renders_as_many_patches_of_a_scene_as_the_sampler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = {part: {phase: [0.1] for phase in phases} for part, phases in SECONDS.items()}
    monkeypatch.setattr(costs_command, "_step_seconds", lambda *_, **__: steps)
    monkeypatch.setattr(costs_command, "SECONDS", 0.0)
    asked = []

    def watched(samples: PatchSamples, states: Tensor, **given: Any) -> PatchJob:
        asked.append(states)
        return start(samples, states, **given)

    start = PatchSamples.start_patches
    monkeypatch.setattr(PatchSamples, "start_patches", watched)
    costs_command.measure(model_clock(tmp_path, "sampler=sobol_quarters", "sampler.chains=8"))
    assert {len(states[:, :-2].unique(dim=0)) for states in asked} == {2}
