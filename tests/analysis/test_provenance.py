"""Provenance and phases as tables: the result files' own values."""

import pandas as pd
import pytest

from analysis.methods import name_methods
from analysis.phases import phase_table
from analysis.provenance import machine_table, provenance_frame, provenance_table
from analysis.runs import Run, find_runs
from analysis.tables import Table

COMMIT = "0123456789abcdef0123456789abcdef01234567"


def records(table: Table) -> list[dict[str, str]]:
    rows = [[cell.text for cell in row] for row in table.rows]
    return pd.DataFrame(rows, columns=table.columns).to_dict("records")


@pytest.fixture
def runs(make_run, tmp_path) -> list[Run]:
    def change(result: dict) -> None:
        result["commit"] = COMMIT
        result["dirty"] = result["seed"] == 1
        result["clock"], result["wall_seconds"] = "model", 400.0 + result["seed"]
        result["energy_joules"] = 2500.0
        result["seconds"]["train"] += 10 * result["seed"]
        result["machine"] = {"processor": "Z80", "gpu": None}

    for seed in range(2):
        make_run(seed=seed, change=change)
    make_run(sampler="mcmc_loss")
    return name_methods(find_runs(tmp_path)[0])


def test_seconds_by_phase_are_means_over_the_seeds(runs) -> None:
    uniform, other = records(phase_table(runs))
    assert (uniform["method"], uniform["n"]) == ("uniform sampling", "2")
    assert (uniform["render"], uniform["train"], uniform["explore"]) == ("100.0", "125.0", "–")
    assert (uniform["clock"], uniform["wall seconds"]) == ("model", "400.5")
    assert (uniform["run seconds"], uniform["energy in kJ"]) == ("240.5", "2.5")
    assert (other["clock"], other["wall seconds"], other["energy in kJ"]) == ("wall", "–", "–")


def test_every_run_has_its_provenance(runs) -> None:
    uniform = [row for row in records(provenance_table(runs)) if "uniform" in row["method"]]
    assert [row["seed"] for row in uniform] == ["0", "1"]
    assert [row["commit"] for row in uniform] == [COMMIT[:12]] * 2
    assert [row["changed files"] for row in uniform] == ["no", "yes"]
    assert [row["configuration"] for row in uniform] == ["mirroruniform0"[:12]] * 2
    assert {row["scene"] for row in uniform} == {"mirror"}
    assert {row["scene files"] for row in uniform} == {"mirror-files"}
    assert {row["references"] for row in uniform} == {"mirror-references"[:12]}


def test_provenance_as_a_frame_is_cut_nowhere(runs) -> None:
    frame = provenance_frame(runs).set_index(["method", "seed"])
    assert frame.loc[("uniform", 1), "commit"] == COMMIT
    assert frame.loc[("uniform", 1), "identity"] == "mirroruniform1"
    assert pd.isna(frame.loc[("mcmc_loss", 0), "commit"])
    assert [str(run.folder) for run in runs] == frame["folder"].tolist()


def test_of_a_run_that_went_on_with_another_commit_both_are_shown(make_run, tmp_path) -> None:
    versions = [{"commit": c * 40, "dirty": c == "a", "code": c * 16} for c in "aab"]
    make_run(change=lambda result: result.update(commits=versions, commit="b" * 40))
    runs = name_methods(find_runs(tmp_path)[0])
    (row,) = records(provenance_table(runs))
    assert (row["commit"], row["changed files"]) == (f"{'a' * 12} then {'b' * 12}", "yes")
    assert provenance_frame(runs)["commit"].item() == f"{'a' * 40} then {'b' * 40}"


def test_machines_are_listed_once(runs) -> None:
    by_method = {row["method"]: row["machine"] for row in records(provenance_table(runs))}
    machines = {row["machine"]: row["what it is"] for row in records(machine_table(runs))}
    assert machines[by_method["uniform sampling"]] == "processor Z80"
    assert machines[by_method["mcmc_loss"]] == "–"
    assert len(machines) == 2
