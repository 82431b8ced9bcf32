"""README.md and docs/learner show the numbers of docs/learner/results.csv."""

from pathlib import Path

import pandas as pd
import pytest
import yaml

from analysis.learner_table import (
    BEFORE,
    MINUTE,
    PAGES,
    learner_table,
    minute_table,
    tables,
    variant_table,
    with_tables,
)
from analysis.parts_of_frames import frames_table
from analysis.runs import METRICS

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(("page", "count"), list(zip(PAGES, (1, 6), strict=True)), ids=str)
def test_the_pages_have_the_numbers_of_the_results(
    page: Path, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    text, found = page.read_text(), tables(page)
    assert len(found) == count
    assert text == with_tables(text, found), "python -m analysis.learner_table writes it"


def test_a_variant_stands_beside_ours() -> None:
    errors = {f"hard_{metric}": 0.1 for metric in METRICS}
    box = {"scene": "box", "seeds": "0 1", **errors}
    results = pd.DataFrame([{**box, "method": m} for m in (BEFORE, "path_tracing_oidn_8spp")])
    variant = pd.DataFrame(
        [
            {**box, "method": "whatever", "hard_mape": 0.05},
            {**box, "method": "reference noise", "seeds": None, "hard_mape": 0.01},
        ]
    )
    table = variant_table(results, variant, "rays").splitlines()
    assert "| ours, then | ours, 8 rays per pixel | Open Image Denoise, 8" in table[0]
    same = "0.100 / **0.100** / **0.100** / **0.100**"
    assert table[2] == f"| box | 2 | {same} | **0.050**{same.removeprefix('0.100')} | {same} |"
    for changed in ({"seeds": "0"}, {"scene": "hall"}):
        with pytest.raises(ValueError, match=r"rays.csv: '(box|hall)' has seeds"):
            variant_table(results, variant.assign(**changed), "rays")


def test_the_minute_has_every_scene_of_its_sweep() -> None:
    minute = pd.read_csv(ROOT / MINUTE)
    sweep = yaml.safe_load((ROOT / "sweeps/minute.yaml").read_text())
    scenes = sweep["hydra"]["sweeper"]["params"]["scene"].replace(" ", "").split(",")
    assert len(scenes) == 16
    assert set(scenes) <= set(minute["scene"])


def test_a_scene_that_a_method_has_not_trained_on_is_named() -> None:
    errors = {f"hard_{metric}": 0.1 for metric in METRICS}
    methods = ("ours", "path_tracing_oidn_8spp", "active_exploration")
    rows = [*(("box", method) for method in methods), *(("hall", m) for m in methods[:2])]
    minute = pd.DataFrame([{"scene": s, "method": m, "seeds": 0, **errors} for s, m in rows])
    assert "| box | 1 |" in minute_table(minute[:3])
    with pytest.raises(ValueError, match="'hall' has no results of active_exploration"):
        minute_table(minute)


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


def test_methods_with_fewer_seeds_are_not_said_to_have_as_many() -> None:
    found = results(ours=(0.1, 0.2), active_exploration=(0.3, 0.2))
    found.loc[found["method"] == "active_exploration", "seeds"] = 0
    table = learner_table(found, ("mape",), ("ours", "active_exploration"))
    assert table.splitlines()[2] == "| box | 2, 1 | **0.100** | 0.300 |"


def test_a_page_without_its_place_is_refused() -> None:
    begin, end = "<!-- rays: written by analysis.learner_table -->", "<!-- end of rays -->"
    page = with_tables(f"a\n{begin}\nold\n{end}\nb", {"rays": "new"})
    assert page == f"a\n{begin}\n\nnew\n\n{end}\nb"
    with pytest.raises(ValueError, match="put the lines '<!-- minute: written"):
        with_tables(page, {"rays": "new", "minute": "new"})
