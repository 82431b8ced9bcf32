from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.ceiling import (
    EVERYWHERE,
    NO_CHOICE,
    RUN,
    concentration,
    differences,
    main,
    metrics_counted,
    read_runs,
)

HEADER = "scene,patches,steps,choice,seed,hard_error,uniform_error,hard_tail,worst_share\n"


def write(folder: Path, *rows: str) -> None:
    """A file per run, as the study leaves them."""
    for number, row in enumerate(rows):
        file = folder / row.split(",")[0] / "runs" / f"{number}.csv"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(HEADER + row + "\n")


METRICS = ("mape", "dssim", "mae", "lpips")


def test_runs_with_and_without_lpips_are_compared_by_what_all_have(tmp_path: Path) -> None:
    """Its weights may come while a study goes on; of a run that diverged there are no metrics."""
    rows = [
        dict(zip((*METRICS, "error"), numbers, strict=True))
        for numbers in (
            [2.0, 4, 8, 64, 8],
            [2, 4, 8, None, 4],
            [None] * 5,
            [np.inf, None, np.inf, None, np.inf],
        )
    ]
    for seed, row in enumerate(rows):
        run = dict(zip(RUN, ("room", 64, 400, "uniform", seed), strict=True))
        named = {f"{frames}_{key}": row[key] for frames in ("hard", "uniform") for key in row}
        folder = tmp_path / "runs"
        folder.mkdir(exist_ok=True)
        pd.DataFrame([run | named | {"worst_share": 0.2}]).to_csv(
            folder / f"{seed}.csv", index=False
        )
    (tmp_path / "runs/1.csv").rename(tmp_path / "later")
    complete = read_runs(tmp_path)
    assert complete["hard_error"].tolist() == pytest.approx([8, np.nan, np.nan], nan_ok=True)
    mean = "The error is the geometric mean of MAPE, DSSIM, MAE"
    assert metrics_counted(complete) == f"{mean}, LPIPS."
    (tmp_path / "later").rename(tmp_path / "runs/1.csv")
    for frames in ("hard", "uniform"):
        found = read_runs(tmp_path)[f"{frames}_error"]
        assert found.tolist() == pytest.approx([4, 4, np.nan, np.nan], nan_ok=True)
    assert main([str(tmp_path)]) == 0
    told = (tmp_path / "tables.md").read_text()
    assert told.startswith(f"{mean}; not all runs have the others.")


def study(folder: Path) -> None:
    write(
        folder,
        "room,64,400,uniform,0,0.10,0.2,0.3,0.2",
        "room,64,400,uniform,1,0.20,0.2,0.3,0.1",
        "room,64,400,oracle,0,0.09,0.2,0.3,0.2",
        "room,64,400,oracle,1,0.16,0.2,0.3,0.2",
        "room,1024,400,uniform,0,0.05,0.1,0.3,0.2",
        "room,1024,400,uniform,1,0.08,0.1,0.3,0.2",
        "egg,64,400,uniform,0,0.10,0.2,0.3,0.2",
        "egg,64,400,oracle,0,0.11,0.2,0.3,0.2",
    )


def only(found: pd.DataFrame, **values: object) -> pd.Series:
    for name, value in values.items():
        found = found[found[name] == value]
    (row,) = [row for _, row in found.iterrows()]
    return row


def test_differences_are_paired_by_seed(tmp_path: Path) -> None:
    study(tmp_path)
    found = differences(read_runs(tmp_path))
    row = only(found, scene="room", choice="oracle", error="hard_error")
    assert row["difference"] == pytest.approx((-0.1 - 0.2) / 2)
    spread = stats.ttest_1samp([-0.1, -0.2], 0).confidence_interval()
    assert row["half_width"] == pytest.approx((spread.high - spread.low) / 2)
    assert row["uniform"] == pytest.approx(0.15)
    everything = only(found, scene="room", choice=NO_CHOICE, error="hard_error")
    assert everything["difference"] == pytest.approx((-0.5 - 0.6) / 2)


def test_runs_of_two_studies_are_not_mixed(tmp_path: Path) -> None:
    """A row does not say with how many samples per pixel it was made, say."""
    for name in ("a", "b"):
        write(tmp_path / name, "room,64,400,uniform,0,0.10,0.2,0.3,0.2")
    named = f"{tmp_path}/a/room/runs/0.csv and {tmp_path}/b/room/runs/0.csv are the same run"
    with pytest.raises(ValueError, match=named):
        read_runs(tmp_path)
    assert len(read_runs(tmp_path / "a")) == 1


def test_of_all_scenes_together_each_is_one_value(tmp_path: Path) -> None:
    study(tmp_path)
    found = differences(read_runs(tmp_path))
    row = only(found, scene=EVERYWHERE, choice="oracle", error="hard_error")
    by_scene = [(-0.1 - 0.2) / 2, 0.1]
    assert (row["difference"], row["n"]) == (pytest.approx(np.mean(by_scene)), 2)
    spread = stats.ttest_1samp(by_scene, 0).confidence_interval()
    assert row["half_width"] == pytest.approx((spread.high - spread.low) / 2)


def test_relmse_is_compared_where_it_was_measured(tmp_path: Path) -> None:
    study(tmp_path)
    assert set(differences(read_runs(tmp_path))["error"]) == {
        *("hard_error", "uniform_error", "hard_tail")
    }
    for file in (tmp_path / "room").rglob("*.csv"):
        runs = pd.read_csv(file)
        file.write_text(runs.assign(hard_relmse=runs["hard_error"] ** 2).to_csv(index=False))
    found = differences(read_runs(tmp_path))
    row = only(found, scene="room", choice="oracle", error="hard_relmse")
    assert row["difference"] == pytest.approx((0.9**2 + 0.8**2) / 2 - 1)
    assert only(found, scene=EVERYWHERE, choice="oracle", error="hard_relmse")["n"] == 1
    assert main([str(tmp_path)]) == 0
    assert "noise-free relMSE, hard frames" in (tmp_path / "tables.md").read_text()


def test_how_concentrated_the_error_is_after_uniform_choice(tmp_path: Path) -> None:
    study(tmp_path)
    rows = [[cell.text for cell in row] for row in concentration(read_runs(tmp_path)).rows]
    assert rows == [
        ["egg", "400", "64", "20.0 %", "1"],
        ["room", "400", "64", "15.0 %", "2"],
        ["room", "400", "1024", "20.0 %", "2"],
    ]


def test_a_study_that_is_not_finished_is_read_as_far_as_it_is(tmp_path: Path) -> None:
    study(tmp_path)
    row = only(differences(read_runs(tmp_path)), scene="egg", error="hard_error")
    assert (row["choice"], row["n"]) == ("oracle", 1)
    assert row["difference"] == pytest.approx(0.1)
    assert pd.isna(row["half_width"])


def test_a_run_that_diverged_is_not_a_missing_one(tmp_path: Path) -> None:
    study(tmp_path)
    write(
        tmp_path / "more",
        "room,64,400,uniform,2,0.10,0.2,0.3,",
        "room,64,400,oracle,2,,0.2,,",
        "egg,64,400,uniform,1,0.10,0.2,0.3,0.1",
        "egg,64,400,oracle,1,inf,0.2,inf,0.1",
    )
    found = differences(read_runs(tmp_path))
    for scene, n in (("room", 3), ("egg", 2), (EVERYWHERE, 2)):
        row = only(found, scene=scene, choice="oracle", error="hard_error")
        assert (np.isfinite(row["difference"]), row["n"]) == (False, n)
        row = only(found, scene=scene, choice="oracle", error="uniform_error")
        assert (row["difference"], row["n"]) == (0, n)
    assert only(found, scene="room", choice=NO_CHOICE, error="hard_error")["n"] == 2
    rows = [[cell.text for cell in row] for row in concentration(read_runs(tmp_path)).rows]
    assert rows[1] == ["room", "400", "64", "15.0 %", "2"]
    assert main([str(tmp_path)]) == 0
    text = (tmp_path / "tables.md").read_text()
    assert "– (3) |" in text
    assert (
        "2 run(s) ended with errors that are not finite, and so do means with them: egg, 64 "
        "patches, 400 steps, oracle, seed 1; room, 64 patches, 400 steps, oracle, seed 2."
    ) in text


def test_a_size_without_choices_yet_is_not_the_pool(tmp_path: Path) -> None:
    """Two sizes of as many steps, interrupted after uniform choice of the second one."""
    study(tmp_path)
    rows = [f"room,128,{steps},uniform,0,0.07,0.1,0.3,0.2" for steps in (400, 1600)]
    write(tmp_path / "then", *rows, "room,32,1600,uniform,0,0.2,0.2,0.3,0.2")
    write(tmp_path / "again", "room,32,1600,oracle,0,0.1,0.2,0.3,0.2")
    found = differences(read_runs(tmp_path))
    everything = only(found, scene="room", choice=NO_CHOICE, error="hard_error")
    assert (everything["steps"], everything["n"]) == (400, 2)
    assert everything["difference"] == pytest.approx((-0.5 - 0.6) / 2)
    assert only(found, scene="room", steps=1600, error="hard_error")["choice"] == "oracle"


def test_tables_say_how_many_seeds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study(tmp_path)
    assert main([str(tmp_path), "--output", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "tables.md").read_text()
    assert "-15.0 ± 63.5 % (2)" in text
    assert text.strip() in capsys.readouterr().out
    assert len(pd.read_csv(tmp_path / "out" / "runs.csv")) == 8


def test_an_empty_folder_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path)]) == 1
    assert "no runs" in capsys.readouterr().err
