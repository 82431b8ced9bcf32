"""The networks that come with the repository open, and show their scenes."""

import json

import pytest
import torch

from ngi.files.resources import root
from ngi.view.trained_run import TrainedRun

FOLDERS = sorted((root() / "scenes").glob("*/network"))
RESOLUTION = 48
SAMPLES = 64


def test_there_are_three() -> None:
    assert len(FOLDERS) == 3


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.parent.name)
def test_a_network_shows_what_paths_show(folder) -> None:
    assert sum(file.stat().st_size for file in folder.iterdir()) < 1e6
    result = json.loads((folder / "result.json").read_text())
    assert len(result["commit"]) == 40
    assert not result["dirty"]
    run = TrainedRun.open(folder)
    v = run.renderer.hard_frames()[0]
    traced = run.renderer.render_image(
        v, resolution=RESOLUTION, samples_per_pixel=SAMPLES, seed=0
    ).log1p()
    shown = run.radiance(v, resolution=RESOLUTION).clamp_min(0).log1p()
    other = run.radiance(run.renderer.hard_frames()[5], resolution=RESOLUTION).clamp_min(0).log1p()
    error = float((shown - traced).abs().mean())
    assert error < 0.05, "mean error of log1p radiance, the noise of 64 samples included"
    assert float((other - traced).abs().mean()) > 1.5 * error, "it shows every v alike"
    assert torch.isfinite(shown).all()
