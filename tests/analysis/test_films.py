"""What `ngi video` measured, as the report shows it."""

import json
from pathlib import Path

import pytest

from analysis.films import film_tables
from analysis.methods import name_methods
from analysis.report import main
from analysis.runs import find_runs

FLOOR = {"srgb": 0.001, "relative": 0.01, "mean_square": 2e-7}


def write_film(file: Path, *runs: str, measure: str = "temporal_error", **measured: dict) -> None:
    film = {
        "options": {"path": "camera", "resolution": 64},
        "scene": "mirror",
        "runs": [{"folder": f, "label": m} for f, m in zip(runs, measured, strict=False)],
        "frames": 24,
        "measure": measure,
        "measured": measured,
    }
    file.write_text(json.dumps(film))


@pytest.fixture
def runs(make_run, tmp_path) -> Path:
    """Two methods; a film of both in the folder of the first."""
    first = make_run()
    second = make_run(sampler="mcmc_loss_step")
    write_film(
        first / "video_camera.json",
        ".",
        f"../../{second.relative_to(first.parents[1])}",
        one={"srgb": 0.012, "relative": 0.1234567, "mean_square": 3e-6},
        other={"srgb": 0.01, "relative": 0.13, "mean_square": -1e-9},
        floor=FLOOR,
    )
    return tmp_path / "runs"


def rows(folder: Path) -> dict[str, list[list[str]]]:
    """By title; a star beside what is marked."""
    tables, warnings = film_tables(folder, name_methods(find_runs(folder)[0]))
    assert warnings == []
    return {
        table.title.split(",")[0]: [[c.text + "*" * c.best for c in row] for row in table.rows]
        for table in tables
    }


def test_the_steadiest_network_is_marked_and_the_reference_is_not(runs) -> None:
    where = ["mirror", "camera", "24 × 64²"]
    assert rows(runs) == {
        "Error of the changes from frame to frame": [
            [*where, "uniform sampling, seed 0", "0.012", "0.123*", "3e-06"],
            [*where, "mcmc_loss_step, seed 0", "0.01*", "0.13", "-1e-09*"],
            [*where, "floor", "0.001", "0.01", "2e-07"],
        ]
    }


def test_a_film_of_one_network_marks_none_and_flicker_has_a_table_of_its_own(runs) -> None:
    still = {"srgb": 0.0, "relative": 0.0}
    write_film(runs / "video.json", "elsewhere", measure="flicker", network=still, traced=still)
    assert rows(runs)["Flicker"] == [
        ["mirror", "camera", "24 × 64²", name, "0", "0"] for name in ("network", "traced")
    ]


def test_a_film_without_a_reference_has_measured_nothing(make_run, tmp_path) -> None:
    write_film(make_run() / "video.json", ".")
    assert rows(tmp_path / "runs") == {}


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"measure": "beauty"}', '{"measure": "flicker", "runs": 3}']
)
def test_a_damaged_film_is_left_out_with_a_warning(runs, content: str) -> None:
    (runs / "video_damaged.json").write_text(content)
    tables, warnings = film_tables(runs, [])
    assert len(tables) == 1
    (warning,) = warnings
    assert "video_damaged.json" in warning


@pytest.mark.usefixtures("undrawn")
def test_the_report_has_them_in_its_page_and_its_tables(runs, capsys) -> None:
    (runs / "video_damaged.json").write_text("{")
    assert main([str(runs)]) == 0
    printed = capsys.readouterr()
    assert "video_damaged.json: not a film" in printed.err
    for text in (
        printed.out,
        (runs / "report" / "index.html").read_text(),
        (runs / "report" / "results.md").read_text(),
    ):
        assert "Error of the changes from frame to frame" in text
        assert "0.123" in text
