import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from ngi.files.record_log import RecordLog


def record(step: int) -> dict[str, object]:
    return {
        "step": step,
        "position": np.float32(step) + np.arange(6, dtype=np.float32).reshape(3, 2) / 8,
        "accepted": np.array([True, False, step % 2 == 0]),
    }


def write(path: Path, steps: range) -> RecordLog:
    log = RecordLog(path, description="what it is")
    for step in steps:
        log.append(record(step))
    log.flush()
    return log


def read(path: Path) -> np.ndarray:
    """By NumPy alone, as the file's first line says."""
    with path.open("rb") as stream:
        header = json.loads(stream.readline())
        fields = [(name, kind, tuple(shape)) for name, kind, shape in header["fields"]]
        return np.fromfile(stream, np.dtype(fields))


def steps_in(path: Path) -> list[int]:
    return read(path)["step"].tolist()


def test_records_read_back_and_the_file_says_what_they_are(tmp_path: Path) -> None:
    write(tmp_path / "log.bin", range(1, 4)).close()
    records = read(tmp_path / "log.bin")
    for index, step in enumerate(range(1, 4)):
        for name, value in record(step).items():
            np.testing.assert_array_equal(records[name][index], value)
    with (tmp_path / "log.bin").open("rb") as stream:
        assert json.loads(stream.readline())["description"] == "what it is"


def test_a_log_is_continued_not_overwritten(tmp_path: Path) -> None:
    write(tmp_path / "log.bin", range(1, 4)).close()
    write(tmp_path / "log.bin", range(4, 6)).close()
    assert steps_in(tmp_path / "log.bin") == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(("step", "kept"), [(0, []), (2, [1, 2]), (9, [1, 2, 3, 4])])
def test_records_after_the_checkpoint_are_dropped(
    tmp_path: Path, step: int, kept: list[int]
) -> None:
    log = write(tmp_path / "log.bin", range(1, 5))
    log.keep_until(step)
    assert steps_in(tmp_path / "log.bin") == kept
    log.append(record(77))
    log.close()
    assert steps_in(tmp_path / "log.bin") == [*kept, 77]


@pytest.mark.parametrize("tail", [b"\1\2\3", bytes(3 * (8 + 24 + 3))], ids=["short", "zeros"])
def test_what_a_crash_leaves_at_the_end_is_dropped(tmp_path: Path, tail: bytes) -> None:
    path = tmp_path / "log.bin"
    write(path, range(1, 4)).close()
    path.write_bytes(path.read_bytes() + tail)
    RecordLog(path, description="").keep_until(10)
    write(path, range(4, 5)).close()
    assert steps_in(path) == [1, 2, 3, 4]


def test_a_long_log_is_not_held_in_memory(tmp_path: Path) -> None:
    log = RecordLog(tmp_path / "log.bin", description="")
    for step in range(2000):
        log.append({"step": step, "position": np.zeros(500)})
    tracemalloc.start()
    try:
        assert log.keep_until(1989) == 10
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()
    assert steps_in(log.path) == list(range(1990))


def test_a_first_line_cut_short_is_written_again(tmp_path: Path) -> None:
    path = tmp_path / "log.bin"
    write(path, range(1, 2)).close()
    path.write_bytes(path.read_bytes()[:20])
    RecordLog(path, description="").keep_until(10)
    write(path, range(1, 3)).close()
    assert steps_in(path) == [1, 2]


def test_a_damaged_first_line_is_named(tmp_path: Path) -> None:
    (tmp_path / "log.bin").write_bytes(b"not JSON\n")
    with pytest.raises(ValueError, match=r"log\.bin is damaged .*delete it"):
        RecordLog(tmp_path / "log.bin", description="").keep_until(1)


@pytest.mark.parametrize(
    "other",
    [
        {"step": 2, "position": np.zeros((3, 2), np.float32)},
        {**record(2), "position": np.zeros((3, 3), np.float32)},
        {**record(2), "position": np.zeros((3, 2))},
    ],
    ids=["fields", "shape", "type"],
)
def test_a_record_that_does_not_fit_is_refused(tmp_path: Path, other: dict[str, object]) -> None:
    log = write(tmp_path / "log.bin", range(1, 2))
    with pytest.raises(ValueError, match=r"log\.bin.*does not fit"):
        log.append(other)
    log.close()
    assert steps_in(tmp_path / "log.bin") == [1]


def test_no_file_is_made_by_cutting_back(tmp_path: Path) -> None:
    RecordLog(tmp_path / "log.bin", description="").keep_until(3)
    assert not (tmp_path / "log.bin").exists()
