import shutil
from pathlib import Path

import pytest
import torch

from ngi.config.hydra_program import MESSAGES
from ngi.train import train
from tests.learn.command_line import BRIEF, run
from tests.learn.forked import configuration


class Blind(torch.nn.Module):
    """A network that makes no whole images."""

    def __init__(self, **_: object) -> None:
        super().__init__()


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("sampler=surprise", ["sampler/surprise", "mcmc_loss_step", "uniform"]),
        ("scene=nowhere", ["scene/nowhere", "sphere-caustic"]),
        ("budget.steps=0", ["budget.steps: 0; expected at least 1"]),
    ],
)
def test_an_error_of_the_command_line_ends_it(
    tmp_path: Path, override: str, words: list[str]
) -> None:
    status, output = run(tmp_path, override, "run.folder=run")
    assert status != 0
    for word in words:
        assert word in output
    assert not (tmp_path / "run" / "steps.csv").exists()


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["resolution.start=8"], ["resolution", "8", "16", "patch"]),
        (["sampler.chains=0"], ["chains", "0"]),
        (["sampler=sobol_quarters", "sampler.chains=6"], ["sampler.chains: 6", "multiple of 4"]),
        (
            [
                *("method=cnsr", "resolution=constant", "resolution.start=16"),
                *("sampler=predicted_from_buffers", "averaging=exponential"),
            ],
            ["sampler: ", "ObservationSets", "sampler=uniform"],
        ),
        (["evaluation.count=0"], ["evaluation.count"]),
        (["run.checkpoint_steps=0"], ["run.checkpoint_steps: 0", "null"]),
        (["run.checkpoint_seconds=-1"], ["run.checkpoint_seconds: -1"]),
        (["trainer.precision=fp16"], ["trainer: ", "fp16", "bf16-mixed"]),
        (["model.hidden_layers=0"], ["hidden_layers"]),
        (["tracker=wandb", "tracker.mode=maybe"], ["tracker.mode", "maybe"]),
        (["run.lpips_weights=/nowhere.pth"], ["nowhere.pth"]),
        (["renderer.patch_size=8"], ["window", "8 x 8"]),
        (
            ["loss._target_=torch.nn.L1Loss", "~loss.l1_weight", "~loss.dssim_weight"],
            ["loss: L1Loss", "shape []", "one loss for each"],
        ),
        (["reuse.when_late=maybe"], ["reuse.when_late", "maybe"]),
        (["optimizer._target_=torch.optim.AdamW"], ["optimizer.weight_decay is 0.01"]),
        (["optimizer._target_=torch.optim.SGD"], ["SGD", "optimizer=muon"]),
        (
            [
                *("renderer.dimensions=2", "sampler=uniform"),
                "optimizer._target_=torch.optim.SGD",
                "evaluation.target_map={_target_: ngi.learn.TargetMap, _partial_: true, cells: 2, "
                "positions_per_cell: 1, target: {_target_: ngi.explore.LossTimesStep}}",
            ],
            ["SGD", "optimizer=muon"],
        ),
        (["optimizer.lr=-1"], ["optimizer: Invalid learning rate: -1"]),
        (["optimizer=muon", "optimizer.momentum=1"], ["optimizer.momentum: 1"]),
        (
            ["schedule=warmup_stable_decay", "schedule.warmup_steps=30", "budget.steps=12"],
            ["schedule.warmup_steps: 30", "budget.steps: 12", "schedule.warmup_steps=3"],
        ),
        (["schedule=warmup_stable_decay", "budget.steps=many"], ["budget.steps", "many"]),
        (["averaging=exponential", "averaging.decay=1"], ["averaging.decay: 1"]),
        (["model._target_=torch.nn.ReLU"], ["model: ReLU", "unexpected", "hidden_features"]),
        ([f"model._target_={__name__}.Blind"], ["model: Blind has no method render"]),
    ],
)
def test_each_error_names_its_key_and_value(
    tmp_path: Path, overrides: list[str], words: list[str]
) -> None:
    with pytest.raises(MESSAGES) as raised:
        train(configuration(tmp_path, *overrides))
    for word in words:
        assert word in str(raised.value)
    assert not (tmp_path / "run" / "result.json").exists()
    assert not (tmp_path / "run" / "steps.csv").exists()
    assert not (tmp_path / "references").exists(), "it came only after references were rendered"


def test_a_key_that_an_optimiser_names_is_not_named_again(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"^optimizer\.lr: -1; expected at least 0$"):
        train(configuration(tmp_path, "optimizer=muon", "optimizer.lr=-1"))


def test_an_unwritable_folder_is_refused_before_anything_is_rendered(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    status, output = run(tmp_path, f"run.folder={tmp_path / 'file' / 'run'}")
    assert status == 1
    assert f"'{tmp_path / 'file' / 'run'}'; choose another folder with run.folder=…" in output
    assert "Traceback" not in output
    assert output.count("change its permissions") == 1
    assert not (tmp_path / "cache").exists()


def test_no_seconds_are_no_budget(tmp_path: Path) -> None:
    status, output = run(tmp_path, "budget.seconds=0", base=BRIEF)
    assert status != 0
    assert "budget.seconds: 0; expected more than 0" in output


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a checkpoint and without a result."""
    folder = tmp_path_factory.mktemp("interrupted")
    status, output = run(folder, "run.folder=run")
    assert status == 0, output
    assert "run 100%|" in output  # the bar's name is the run's
    (folder / "run" / "result.json").unlink()
    return folder


def copy(interrupted: Path, to: Path) -> Path:
    shutil.copytree(interrupted / "run", to / "run")
    return to / "run"


def test_the_checkpoint_of_another_run_is_refused(tmp_path: Path, interrupted: Path) -> None:
    folder = copy(interrupted, tmp_path)
    (folder / "settings.json").unlink()
    status, output = run(tmp_path, "run.folder=run", "seed=5")
    assert status != 0
    assert "last.ckpt belongs to run" in output


def test_a_missing_patch_file_is_named(tmp_path: Path, interrupted: Path) -> None:
    folder = copy(interrupted, tmp_path)
    segment = next((folder / "patches").iterdir())
    segment.unlink()
    status, output = run(tmp_path, "run.folder=run")
    assert status != 0
    assert segment.name in output


def test_the_folder_of_another_run_is_refused(tmp_path: Path, interrupted: Path) -> None:
    folder = copy(interrupted, tmp_path)
    checkpoint = (folder / "last.ckpt").read_bytes()
    status, output = run(tmp_path, "run.folder=run", "optimizer.lr=0.5")
    assert status != 0
    assert "optimizer.lr: 0.001 there, 0.5 now" in output
    assert (folder / "last.ckpt").read_bytes() == checkpoint


def test_a_run_killed_before_its_result_only_evaluates(tmp_path: Path, interrupted: Path) -> None:
    folder = copy(interrupted, tmp_path)
    before = torch.load(folder / "last.ckpt", weights_only=True)
    metrics = (folder / "metrics.csv").read_text().splitlines()
    status, output = run(tmp_path, "run.folder=run")
    assert status == 0, output
    after = torch.load(folder / "last.ckpt", weights_only=True)
    assert before["global_step"] == after["global_step"]
    assert (folder / "result.json").exists()
    assert len((folder / "metrics.csv").read_text().splitlines()) == len(metrics)
