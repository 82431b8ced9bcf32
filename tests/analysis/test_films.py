"""What `ngi video` measured, as the report shows it."""

import json
from pathlib import Path

import pytest

from analysis.films import film_tables
from analysis.methods import name_methods
from analysis.report import main
from analysis.runs import find_runs

FLOOR = {"srgb": 0.001, "relative": 0.01, "mean_square": 2e-7}


STILL = {"srgb": 0.0, "relative": 0.0}


def write_film(file: Path, *runs: str, measure: str = "temporal_error", **measured: dict) -> None:
    """As a version wrote it that said little; `change_film` adds the rest."""
    film = {
        "options": {"path": "camera", "resolution": 64},
        "scene": "mirror",
        "runs": [{"folder": f, "label": m} for f, m in zip(runs, measured, strict=False)],
        "frames": 24,
        "measure": measure,
        "measured": measured,
    }
    file.write_text(json.dumps(film))


def change_film(file: Path, *steps: int, scene_hash: str = "mirror-files", **options) -> None:
    """steps: of its runs"""
    film = json.loads(file.read_text())
    film["scene_hash"] = scene_hash
    film["options"] |= options
    for run, step in zip(film["runs"], steps, strict=True):
        run["step"] = step
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


def rows(folder: Path, *expected: str) -> dict[str, list[list[str]]]:
    """By title; a star beside what is marked. expected: warnings"""
    tables, warnings = film_tables(folder, name_methods(find_runs(folder)[0]))
    assert warnings == list(expected)
    return {
        table.title.split(",")[0]: [[c.text + "*" * c.best for c in row] for row in table.rows]
        for table in tables
    }


def test_the_steadiest_network_is_marked_and_the_reference_is_not(runs) -> None:
    where = ["mirror", "camera", "24 × 64²", "–"]
    assert rows(runs) == {
        "Error of the changes from frame to frame": [
            [*where, "uniform sampling, seed 0", "0.012", "0.123*", "3e-06"],
            [*where, "mcmc_loss_step, seed 0", "0.01*", "0.13", "-1e-09*"],
            [*where, "floor", "0.001", "0.01", "2e-07"],
        ]
    }


def test_a_film_of_one_network_marks_none_and_flicker_has_a_table_of_its_own(runs) -> None:
    write_film(runs / "video.json", "elsewhere", measure="flicker", network=STILL, traced=STILL)
    assert rows(runs)["Flicker"] == [
        ["mirror", "camera", "24 × 64²", "–", name, "0", "0"] for name in ("elsewhere", "traced")
    ]


def test_films_of_other_options_have_other_cells(make_run, tmp_path) -> None:
    run = make_run()
    for number, options in enumerate(
        (
            {"hard_frame": 0, "reference": 0},
            {"hard_frame": 3, "reference": 0},
            {"hard_frame": 3, "reference": 1024, "supersampled_edges": False},
            {"hard_frame": 3, "reference": 1024, "supersampled_edges": True},
        )
    ):
        file = run / f"video_{number}.json"
        write_film(file, ".", measure="flicker", network=STILL)
        change_film(file, 1000, path="static", **options)
    assert [row[1:5] for row in rows(tmp_path / "runs")["Flicker"]] == [
        ["static, hard frame 0", "24 × 64²", "–", "uniform sampling, seed 0"],
        ["static, hard frame 3", "24 × 64²", "–", "uniform sampling, seed 0"],
        ["static, hard frame 3", "24 × 64²", "1,024 spp", "uniform sampling, seed 0"],
        [
            "static, hard frame 3",
            "24 × 64², supersampled edges",
            "1,024 spp",
            "uniform sampling, seed 0",
        ],
    ]


def test_a_network_that_was_trained_on_since_is_left_out(runs) -> None:
    film = runs / "mirror" / "uniform" / "seed=0" / "video_camera.json"
    other = runs / "mirror" / "mcmc_loss_step" / "seed=0"
    change_film(film, 1000, 500)
    warning = f"left out: {film}: film of step 500, {other} has 1000 steps: film it again"
    (found,) = rows(runs, warning).values()
    # Alone, the other is no longer the steadiest of several.
    assert [row[4:6] for row in found] == [
        ["uniform sampling, seed 0", "0.012"],
        ["floor", "0.001"],
    ]
    assert found[0][6] == "0.123"
    change_film(film, 500, 500)
    tables, warnings = film_tables(runs, name_methods(find_runs(runs)[0]))
    assert tables == []
    assert [warning.split(": ")[2] for warning in warnings] == [
        f"film of step 500, {folder} has 1000 steps" for folder in (film.parent, other)
    ]


def test_a_film_of_another_version_of_the_scene_is_left_out(runs) -> None:
    run = runs / "mirror" / "uniform" / "seed=0"
    change_film(run / "video_camera.json", 1000, 1000, scene_hash="older files")
    warning = f"{run} has another version of the scene: film it again"
    assert rows(runs, f"left out: {run / 'video_camera.json'}: {warning}") == {}


def test_a_film_that_measured_nothing_needs_no_warning(make_run, tmp_path) -> None:
    film = make_run() / "video.json"
    write_film(film, ".", network={})
    content = json.loads(film.read_text())
    film.write_text(json.dumps({**content, "measured": {}, "scene_hash": "older files"}))
    assert rows(tmp_path / "runs") == {}


def test_interrupted_runs_are_told_by_folder_and_step(make_run, tmp_path) -> None:
    make_run()
    for seed in (1, 2):
        folder = make_run(seed=seed)
        (folder / "result.json").unlink()
        write_film(folder / "video_static.json", ".", measure="flicker", network=STILL)
        change_film(folder / "video_static.json", 500)
    runs = tmp_path / "runs"
    tables, _ = film_tables(runs, name_methods(find_runs(runs)[0]))
    assert [row[4].text for row in tables[0].rows] == [
        f"mirror/uniform/seed={seed}, step 500" for seed in (1, 2)
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
