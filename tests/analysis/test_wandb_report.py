"""The report's tables as Weights & Biases keeps them offline."""

import json
from pathlib import Path

import pandas as pd
import pytest

from analysis.report import main
from tests.learn.wandb_files import of_kind, records, summary


@pytest.fixture
def runs(make_run, tmp_path, monkeypatch) -> Path:
    for seed in range(2):
        make_run(seed=seed)
    monkeypatch.setattr(
        "analysis.report_files.write_page", lambda _contents, file, _progress: file.touch()
    )
    return (tmp_path / "runs").rename(tmp_path / "seed=0,1")


@pytest.mark.usefixtures("undrawn")
def test_tables_are_an_artifact_of_a_run_of_their_own(runs: Path, capsys) -> None:
    assert main([str(runs), "--wandb", "caustics"]) == 0
    (file,) = (runs / "report" / "wandb").glob("offline-run-*/*.wandb")
    assert str(file.parent) in capsys.readouterr().out
    found = records(file)
    run = next(of_kind(found, "run"))
    assert (run["project"], run["job_type"]) == ("caustics", "report")
    assert run["display_name"] == "report of seed=0,1"
    assert "run_group" not in run, "runs are grouped by sweep, whatever their folder is called"
    (artifact,) = [a for a in of_kind(found, "artifact") if a["type"] == "report"]
    assert artifact["name"] == "report-seed-0-1", "W&B takes no other signs"
    kept = {entry["path"]: int(entry.get("size", 0)) for entry in artifact["manifest"]["contents"]}
    names = {"results.csv", "results.md", "results.tex", "provenance.csv", "index.html"}
    assert kept == {name: (runs / "report" / name).stat().st_size for name in names}
    table = json.loads((file.parent / "files" / summary(found)["results.path"]).read_text())
    results = pd.read_csv(runs / "report" / "results.csv")
    assert table["columns"] == results.columns.tolist()
    assert len(table["data"]) == len(results)
    assert table["data"][0][:3] == results.iloc[0, :3].tolist()


@pytest.mark.usefixtures("undrawn")
def test_what_fails_there_is_said_and_the_report_is_written(
    runs: Path, monkeypatch, capsys
) -> None:
    def unreachable(*_, **__):
        raise OSError("no route to host")

    monkeypatch.setattr("wandb.init", unreachable)
    assert main([str(runs), "--wandb", "caustics"]) == 1
    assert "error: Weights & Biases: no route to host" in capsys.readouterr().err
    assert (runs / "report" / "results.csv").exists()
