"""Tables and picture of what each part of ours is worth."""

import sys
from io import BytesIO

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from analysis import parts_of_learner
from analysis.parts_of_learner import draw, errors_by_part, over_all_scenes, parts_table
from analysis.runs import METRICS, find_runs


def ablation() -> pd.DataFrame:
    errors = (
        ("box", "ours", 0.1),
        ("box", "active_exploration", 0.4),
        ("box", "ours_without/big_steps", 0.12),
        ("box", "ours_without/small_steps", 0.11),
        ("box", "paper_with/big_steps", 0.3),
        ("box", "paper_with/more", 0.5),
        ("hall", "ours", 0.2),
        ("hall", "ours_without/small_steps", 0.3),
        ("hall", "ours_uniform", 0.18),
        ("alone", "ours", 0.1),
        ("partial", "ours_without/small_steps", 0.3),
    )
    rows = [{"scene": s, "method": m, **{f"hard_{k}": e for k in METRICS}} for s, m, e in errors]
    rows[0] |= {"hard_mape": 0.2, "hard_dssim": 0.05}  # the same geometric mean
    return pd.DataFrame(rows)


def test_parts_are_compared_with_the_whole_that_they_belong_to() -> None:
    assert parts_table(ablation()).splitlines() == [
        "| taken out of ours | box | hall | all of them |",
        "| :-- | --: | --: | --: |",
        "| *nothing* | **0.1000** | **0.2000** |  |",
        "| small steps | 0.1100 (+10%) | 0.3000 (+50%) | +28% |",
        "| big steps | 0.1200 (+20%) |  | +20% |",
        "| sobol sequence |  | 0.1800 (-10%) | -10% |",
        "",
        "| added to the paper's method | box | all of them |",
        "| :-- | --: | --: |",
        "| *nothing* | **0.4000** |  |",
        "| big steps | 0.3000 (-25%) | -25% |",
        "| more | 0.5000 (+25%) | +25% |",
    ]


def test_effects_are_geometric_means_over_scenes() -> None:
    effects = over_all_scenes(errors_by_part(ablation(), "ours"))
    assert effects["small_steps"] == pytest.approx(np.sqrt(1.1 * 1.5) - 1)
    assert effects[""] == 0
    assert errors_by_part(ablation().iloc[[2, 3]], "ours").empty


@pytest.fixture
def folder(tmp_path, make_method):
    for scene in ("box", "hall"):
        make_method("ours", scene=scene, error=0.1)
        make_method("ours_without/big_steps", scene=scene, error=0.2)
        make_method("active_exploration", scene=scene, error=0.4)
        make_method("paper_with/big_steps", scene=scene, error=0.3)
    return tmp_path


def test_the_picture_has_a_panel_per_ablation_and_scene(folder, tmp_path, monkeypatch) -> None:
    runs, _ = find_runs(folder)
    assert len(runs) == 8
    picture = tmp_path / "parts.png"
    monkeypatch.setattr(sys, "argv", ["parts_of_learner", str(folder), str(picture)])
    assert parts_of_learner.main() == 0
    assert picture.read_bytes() == draw(runs)
    pixels = np.asarray(Image.open(BytesIO(picture.read_bytes())).convert("RGB")).astype(int)
    coloured = (pixels.max(axis=2) - pixels.min(axis=2)) > 60
    height, width = coloured.shape
    for row in (slice(0, height // 2), slice(height // 2, height)):
        for column in (slice(0, int(0.35 * width)), slice(int(0.35 * width), int(0.7 * width))):
            assert coloured[row, column].any()


def test_runs_without_a_whole_method_are_refused(folder, tmp_path, monkeypatch, capsys) -> None:
    runs = [run for run in find_runs(folder)[0] if run.label["method"] != "active_exploration"]
    with pytest.raises(ValueError, match="no runs of active_exploration with its parts"):
        draw(runs)
    monkeypatch.setattr(sys, "argv", ["parts_of_learner", str(tmp_path / "none"), "a.png"])
    assert parts_of_learner.main() == 1
    monkeypatch.setattr(sys, "argv", ["parts_of_learner"])
    assert parts_of_learner.main() == 2
    assert "PICTURE.png" in capsys.readouterr().err
