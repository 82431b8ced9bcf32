"""Runs of the denoiser ANF on closed formulas."""

from math import pi, sqrt
from pathlib import Path

import pytest

from ngi.train import train
from tests.learn.command_line import run
from tests.learn.comparison import assert_same_run
from tests.learn.composition import run_config
from tests.learn.lightning_warnings import IGNORED
from tests.learn.test_resume import kill_after_checkpoint

pytestmark = IGNORED

SHORT = (
    *("renderer=analytic", "method=anf", "evaluation=smoke", "evaluation.count=1"),
    *("renderer.patch_size=16", "resolution.start=32", "+renderer.noise=2.0", "data.frames=2"),
    *("model.hidden_features=8", "model.hidden_layers=2", "model.dilations=[1]"),
    *("sampler.chains=2", "reuse.store.capacity=8", "budget=steps", "budget.steps=40"),
    *("run.folder=run", "run.checkpoint_steps=10"),
)


def test_a_run_of_anf_takes_most_of_the_noise_from_its_scene(tmp_path: Path) -> None:
    options = (
        *("method=anf", "budget=steps", "budget.steps=180", "evaluation=smoke"),
        *("evaluation.count=1", "renderer.patch_size=32", "resolution.start=32"),
        *("+renderer.noise=2.0", "model.hidden_features=16", "model.hidden_layers=4"),
        *("model.dilations=[1,2,4]", "data.frames=2", "data.target_renderings=8"),
        *("reuse.store.capacity=12", "optimizer.lr=5e-3"),
        *(
            f"evaluation.evaluator.protocol.{n}"
            for n in ("samples_per_pass=1024", "maximum_samples=4096")
        ),
        *(f"run.folder={tmp_path / 'run'}", f"run.references={tmp_path / 'references'}"),
    )
    result = train(run_config(*options))
    assert result["patches_traced"] == 12 * 2  # the store is full, and nothing more is rendered
    noise = sqrt(2 / pi) * 2 / sqrt(8)  # mean |error| of what it is given
    assert result["metrics"]["hard"]["mape"]["mean"] < 0.7 * noise
    assert set(result["frame_seconds"]) == {"buffers", "inputs", "network"}


def test_a_killed_run_ends_like_an_undisturbed_one(tmp_path: Path) -> None:
    for name in ("unbroken", "killed"):
        (tmp_path / name).mkdir()
    status, output = run(tmp_path / "unbroken", base=SHORT)
    assert status == 0, output
    kill_after_checkpoint(tmp_path / "killed", *SHORT)
    assert not (tmp_path / "killed" / "run" / "result.json").exists(), "it was not killed in time"
    status, output = run(tmp_path / "killed", base=SHORT)
    assert status == 0, output
    assert_same_run(tmp_path / "unbroken" / "run", tmp_path / "killed" / "run")


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("data=patches", "model and data do not fit"),
        ("model=pixel_generator", "model and data do not fit"),
        ("loss=l1_dssim", "expected the same shape"),
        ("data.frames=1", "data.frames is 1"),
        ("model.kernel_size=4", "model.kernel_size is 4"),
        ("model.dilations=few", "model.dilations"),
        ("resolution.start=48", "less than a patch of 64"),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_is_rendered(
    tmp_path: Path, override: str, message: str
) -> None:
    options = ("method=anf", "budget=smoke", f"run.folder={tmp_path / 'run'}", override)
    with pytest.raises((ValueError, TypeError), match=message):
        train(run_config(*options))
    assert not list(tmp_path.rglob("metrics.csv"))
