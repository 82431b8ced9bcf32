"""The examples count what they leave out, and compare only what can be compared."""

import math
import runpy
import sys
from pathlib import Path

import pandas as pd
import pytest


@pytest.fixture
def ask(monkeypatch, capsys):
    """What an example prints; the folder with the runs is its first argument."""

    def run(name: str, folder: Path, *arguments: str):
        monkeypatch.setattr(sys, "argv", [name, str(folder), *arguments])
        runpy.run_module(f"analysis.examples.{name}")
        return capsys.readouterr()

    return run


def diverge(run: Path) -> None:
    table = pd.read_csv(run / "metrics.csv")
    table.loc[4:, [name for name in table if name.startswith("hard")]] = math.nan
    table.to_csv(run / "metrics.csv", index=False)


def cells(table: str) -> list[list[str]]:
    """Of the rows of a table in Markdown."""
    lines = [line for line in table.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[2:]]


COMPARED = {"same_steps": (), "time_to_error": ("metropolis", "uniform")}


@pytest.mark.parametrize("name", COMPARED)
def test_runs_that_are_left_out_are_named(ask, make_method, tmp_path, name) -> None:
    for method in COMPARED["time_to_error"]:
        make_method(method)
    (make_method("uniform", seed=7) / "result.json").unlink()
    assert "unfinished" in ask(name, tmp_path, *COMPARED[name]).err


@pytest.mark.parametrize("name", COMPARED)
def test_what_cannot_be_compared_is_refused(ask, makers_below, tmp_path, name) -> None:
    make_method = makers_below(tmp_path / "once")[1]
    for method in COMPARED["time_to_error"]:
        make_method(method)
    makers_below(tmp_path / "again")[1]("uniform")
    with pytest.raises(ValueError, match="are the same method"):
        ask(name, tmp_path, *COMPARED[name])
    make_method("sobol", change=lambda result: result["protocol"].update(identity="another"))
    with pytest.raises(ValueError, match="different protocols"):
        ask(name, tmp_path / "once", *COMPARED[name])


def test_differences_say_how_many_runs_diverged(ask, make_method, tmp_path) -> None:
    for seed in range(3):
        make_method("uniform", seed=seed)
        worse = make_method("metropolis", seed=seed, error=0.11)
    diverge(worse)
    diverge(make_method("sobol"))
    _, lost, found, *both, other = ask("same_steps", tmp_path).out.splitlines()
    assert lost == "metropolis: left out 1 of 3 pairs, one of whose runs diverged"
    assert found == "metropolis: 2 runs, 1.000 of the steps"
    assert [line.split()[4] for line in both] == ["+10.0", "+10.0"]
    assert other == "sobol: left out 1 of 1 pairs, one of whose runs diverged"


def test_scenes_of_two_budgets_are_not_averaged(ask, make_method, tmp_path) -> None:
    scenes = {"mirror": "small", "bedroom": "small", "bathroom": "hour"}
    for scene, budget in scenes.items():
        make_method("uniform", scene=scene, budget=budget)
        error = {"small": 0.11, "hour": 0.2}[budget]
        make_method("metropolis", scene=scene, budget=budget, error=error)
    _, found, *both = ask("same_steps", tmp_path).out.splitlines()
    assert found == "metropolis, budget=small alone: 2 runs, 1.000 of the steps"
    assert [line.split()[4] for line in both] == ["+10.0", "+10.0"]


def test_a_part_of_the_time_is_missing_where_there_is_none(ask, make_method, tmp_path) -> None:
    """Half the error at every time: below the other's last one at e^(-t/100) = (2 d - 1) / 7."""
    for seed in range(2):
        for scene in ("bathroom", "bedroom", "mirror"):
            ours = make_method("ours", scene=scene, seed=seed)
            theirs = make_method("uniform", scene=scene, seed=seed, error=0.2)
            if scene == "mirror":  # as path tracing, which is not trained
                table = pd.read_csv(theirs / "metrics.csv").tail(1).assign(run_seconds=0.0)
                table.to_csv(theirs / "metrics.csv", index=False)
            elif scene == "bathroom" and seed:
                diverge(ours)
    (_, lost, *_, undefined), (_, seeds, *_, error, time), (_, both, *_, change, missing) = cells(
        ask("time_to_error", tmp_path, "ours", "uniform").out
    )
    assert (lost, undefined) == ("2 (1 diverged)", "–")
    assert (seeds, error) == ("2", "-50.000 ± 0.000 %")
    expected = -100 * math.log((2 * (1 + 7 * math.exp(-2.4)) - 1) / 7) / 240
    assert float(time) == pytest.approx(expected, abs=0.005)
    assert (both, change, missing) == ("2", "-50.000 ± 0.000 %", "–")


def test_a_time_is_the_mean_over_all_seeds_or_none(ask, make_method, tmp_path) -> None:
    """Metropolis is there first with one seed, and never with the two others."""
    curves = {"uniform": 3 * [[1, 1, *7 * [0.1]]]}
    curves["metropolis"] = [[1, *8 * [end]] for end in (0.05, 0.2, 0.2)]
    for method, of_seeds in curves.items():
        for seed, errors in enumerate(of_seeds):
            file = make_method(method, seed=seed) / "metrics.csv"
            table = pd.read_csv(file).assign(hard_mape=errors)
            table.assign(run_seconds=10.0 * table.index).to_csv(file, index=False)
    *_, seconds, _ = ask("questions", tmp_path).out.split("\n\n")
    rows = [line.split()[-3:] for line in seconds.splitlines()[-2:]]
    assert rows == [["metropolis", "NaN", "1"], ["uniform", "20.0", "3"]]
