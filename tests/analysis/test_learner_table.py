"""README.md and docs/learner show the numbers of docs/learner/results.csv."""

import json
from pathlib import Path

import pandas as pd
import pytest
import yaml

from analysis.learner_table import (
    ABLATION,
    BEGIN,
    END,
    FRAMES,
    MINUTE,
    OF_MINUTE,
    PAGES,
    RESULTS,
    VARIANTS,
    learner_table,
    with_frames,
    with_minute,
    with_parts,
    with_variant,
    written,
)
from analysis.parts_of_frames import frames_table
from analysis.runs import METRICS

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_the_pages_have_the_numbers_of_the_results(page: Path) -> None:
    text = (ROOT / page).read_text()
    assert text == written(text, pd.read_csv(ROOT / RESULTS), page), (
        "python -m analysis.learner_table writes it"
    )


def test_the_page_has_the_numbers_of_the_ablation() -> None:
    text = (ROOT / "docs/learner/README.md").read_text()
    assert text == with_parts(text, pd.read_csv(ROOT / ABLATION)), (
        "python -m analysis.learner_table writes it"
    )


@pytest.mark.parametrize("name", VARIANTS)
def test_the_page_has_the_numbers_of_what_ours_was_varied_in(name: str) -> None:
    text = (ROOT / "docs/learner/README.md").read_text()
    results, variant = pd.read_csv(ROOT / RESULTS), pd.read_csv(ROOT / VARIANTS[name][0])
    assert text == with_variant(text, results, variant, name), (
        "python -m analysis.learner_table writes it"
    )


def test_a_variant_stands_beside_ours() -> None:
    errors = {f"hard_{metric}": 0.1 for metric in METRICS}
    box = {"scene": "box", "seeds": "0 1", **errors}
    results = pd.DataFrame([{**box, "method": m} for m in ("ours", "path_tracing_oidn_8spp")])
    variant = pd.DataFrame(
        [
            {**box, "method": "whatever", "hard_mape": 0.05},
            {**box, "method": "reference noise", "seeds": None, "hard_mape": 0.01},
        ]
    )
    begin, end = "<!-- rays: written by analysis.learner_table -->", "<!-- end of rays -->"
    table = with_variant(f"{begin}\n{end}", results, variant, "rays").splitlines()
    assert "| ours | ours, 8 rays per pixel | Open Image Denoise, 8" in table[2]
    same = "0.100 / **0.100** / **0.100** / **0.100**"
    assert table[4] == f"| box | 2 | {same} | **0.050**{same.removeprefix('0.100')} | {same} |"
    for changed in ({"seeds": "0"}, {"scene": "hall"}):
        with pytest.raises(ValueError, match=r"rays.csv: '(box|hall)' has seeds"):
            with_variant(f"{begin}\n{end}", results, variant.assign(**changed), "rays")


def test_the_page_has_the_times_of_the_benchmark() -> None:
    text = (ROOT / "docs/learner/README.md").read_text()
    assert text == with_frames(text, json.loads((ROOT / FRAMES).read_text())), (
        "python -m analysis.learner_table writes it"
    )


def test_the_page_has_the_numbers_of_every_scene_of_the_minute() -> None:
    text = (ROOT / "docs/learner/README.md").read_text()
    minute = pd.read_csv(ROOT / MINUTE)
    assert text == with_minute(text, minute), "python -m analysis.learner_table writes it"
    sweep = yaml.safe_load((ROOT / "sweeps/minute.yaml").read_text())
    scenes = sweep["hydra"]["sweeper"]["params"]["scene"].replace(" ", "").split(",")
    assert len(scenes) == 16
    assert set(scenes) <= set(minute["scene"])


def test_a_scene_that_a_method_has_not_trained_on_is_named() -> None:
    errors = {f"hard_{metric}": 0.1 for metric in METRICS}
    methods = ("ours", "path_tracing_oidn_8spp", "active_exploration")
    rows = [*(("box", method) for method in methods), *(("hall", m) for m in methods[:2])]
    minute = pd.DataFrame([{"scene": s, "method": m, "seeds": 0, **errors} for s, m in rows])
    page = "\n".join(OF_MINUTE)
    assert "| box | 1 |" in with_minute(page, minute[:3])
    with pytest.raises(ValueError, match="'hall' has no results of active_exploration"):
        with_minute(page, minute)


def frame_figure(name: str, median: float, unit: str = "ms", *, part: str = "frames") -> dict:
    return {"name": name, "median": median, "scene": "box", "part": part, "unit": unit}


def test_frames_have_a_row_per_scene_and_resolution() -> None:
    figures = [
        frame_figure("rays, all of them, 96 × 96", 1234.4),
        frame_figure("ours / paths and denoiser, 96 × 96", 0.456, "×"),
        frame_figure("rays, all of them, 256 × 256", 2.5),
        frame_figure("ours / paths and denoiser, 256 × 256", 1.0, "×"),
        frame_figure("step, 8x512", 1.0, part="training"),
    ]
    assert frames_table(figures).splitlines() == [
        "| scene | pixels | rays, all of them | ours / paths and denoiser |",
        "| :-- | --: | --: | --: |",
        "| box | 96 × 96 | 1,234 | 0.46 |",
        "| box | 256 × 256 | 2 | 1.00 |",
    ]
    with pytest.raises(ValueError, match="box, 256 pixels: 'ours / paths and denoiser' was not"):
        frames_table(figures[:3])


def results(**errors: tuple[float, float]) -> pd.DataFrame:
    rows = [
        {"scene": "box", "method": m, "seeds": "0 1", "hard_mape": e[0], "hard_mae": e[1]}
        for m, e in errors.items()
    ]
    other = {"scene": "alone", "method": "ours", "seeds": 0, "hard_mape": 1.0, "hard_mae": 1.0}
    return pd.DataFrame([*rows, other])


def test_the_lowest_error_of_each_metric_is_bold_and_ties_are() -> None:
    table = learner_table(
        results(ours=(0.1, 0.2004), active_exploration=(0.3, 0.2)),
        ("mape", "mae"),
        ("ours", "active_exploration"),
    )
    assert table.splitlines()[2:] == ["| box | 2 | **0.100** / **0.200** | 0.300 / **0.200** |"]


def test_a_page_without_its_place_is_refused() -> None:
    with pytest.raises(ValueError, match="put the lines"):
        written("nothing", results(ours=(1, 1)), Path("README.md"))
    page = f"a\n{BEGIN}\nold\n{END}\nb"
    assert "old" not in written(page, results(ours=(1, 1)), Path("README.md"))
