import tracemalloc
from pathlib import Path

import pandas as pd
import pytest

from ngi.files import row_log
from ngi.files.row_log import RowLog


def write(path: Path, steps: range) -> RowLog:
    log = RowLog(path)
    for step in steps:
        log.append({"step": step, "loss": step / 8, "note": "a,b"})
    log.flush()
    return log


def test_rows_read_back(tmp_path: Path) -> None:
    write(tmp_path / "log.csv", range(1, 4)).close()
    table = pd.read_csv(tmp_path / "log.csv")
    assert table["step"].tolist() == [1, 2, 3]
    assert table["loss"].tolist() == [1 / 8, 2 / 8, 3 / 8]
    assert table["note"].tolist() == ["a,b"] * 3


def test_a_log_is_continued_not_overwritten(tmp_path: Path) -> None:
    write(tmp_path / "log.csv", range(1, 4)).close()
    write(tmp_path / "log.csv", range(4, 6)).close()
    assert pd.read_csv(tmp_path / "log.csv")["step"].tolist() == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(("step", "kept"), [(0, []), (2, [1, 2]), (9, [1, 2, 3, 4])])
def test_rows_after_the_checkpoint_are_dropped(tmp_path: Path, step: int, kept: list[int]) -> None:
    log = write(tmp_path / "log.csv", range(1, 5))
    log.keep_until(step)
    assert pd.read_csv(tmp_path / "log.csv")["step"].tolist() == kept
    log.append({"step": 77, "loss": 0.0, "note": ""})
    log.close()
    assert pd.read_csv(tmp_path / "log.csv")["step"].tolist() == [*kept, 77]


def test_a_line_cut_short_by_a_crash_is_dropped(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    write(path, range(1, 4)).close()
    path.write_text(path.read_text() + "4,0.")
    assert RowLog(path).last_step == 3
    RowLog(path).keep_until(10)
    assert pd.read_csv(path)["step"].tolist() == [1, 2, 3]


@pytest.mark.parametrize("block", [1, 7, 1 << 16])
def test_the_last_whole_row_is_found_wherever_blocks_end(
    tmp_path: Path, monkeypatch, block
) -> None:
    path = tmp_path / "log.csv"
    monkeypatch.setattr(row_log, "BLOCK", block)
    write(path, range(1, 12)).close()
    for tail in ("", "\n", "no step,at all\n", "\0" * 40, "12,0."):
        path.write_text(path.read_text() + tail)
        assert RowLog(path).last_row == {"step": "11", "loss": str(11 / 8), "note": "a,b"}
    path.write_text("step,loss\n12,0.")
    assert RowLog(path).last_row is None


def test_a_long_log_is_not_held_in_memory(tmp_path: Path) -> None:
    log, count = RowLog(tmp_path / "log.csv"), 50_000
    with log.path.open("w") as stream:
        stream.write("step,loss\n")
        stream.writelines(f"{step},{'0' * 200}\n" for step in range(count))
    tracemalloc.start()
    try:
        assert log.last_step == count - 1
        assert log.keep_until(count - 11) == 10
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()
    assert log.last_step == count - 11
    assert log.path.stat().st_size == len("step,loss\n") + sum(
        len(f"{step},\n") + 200 for step in range(count - 10)
    )


@pytest.mark.parametrize("header", ["\0\0\0\0", "lo", "step,lo", "\n"])
def test_a_log_whose_header_a_crash_cut_short_begins_again(tmp_path: Path, header: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(header)
    assert RowLog(path).last_step == 0
    RowLog(path).keep_until(0)
    write(path, range(1, 3)).close()
    assert pd.read_csv(path)["step"].tolist() == [1, 2]


def test_missing_values_stay_empty_and_unknown_columns_are_refused(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", range(1, 2))
    log.append({"step": 2})
    with pytest.raises(ValueError, match="surprise"):
        log.append({"step": 3, "surprise": 1})
    log.close()
    assert pd.read_csv(tmp_path / "log.csv")["loss"].isna().tolist() == [False, True]


def test_no_file_is_made_by_cutting_back(tmp_path: Path) -> None:
    RowLog(tmp_path / "log.csv").keep_until(3)
    assert not (tmp_path / "log.csv").exists()


def test_a_log_that_an_older_version_began_is_continued(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("step,loss\n1,0.5\n")
    write(tmp_path / "log.csv", range(2, 4)).close()
    table = pd.read_csv(tmp_path / "log.csv")
    assert list(table) == ["step", "loss"]
    assert table["loss"].tolist() == [0.5, 2 / 8, 3 / 8]
