from mmap import mmap
from pathlib import Path

from ngi.machine.memory import COLUMNS, usage


def test_memory_files_and_folder_grow_by_what_is_added(tmp_path: Path) -> None:
    before = usage(tmp_path)
    assert tuple(before) == COLUMNS
    held = mmap(-1, 50 * 2**20)  # from the system, not from what this process has freed
    for page in range(0, len(held), 4096):
        held[page] = 1
    streams = [(tmp_path / name).open("wb") for name in "abc"]
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "file").write_bytes(bytes(1234))
    grown = {name: (usage(tmp_path)[name] or 0) - (before[name] or 0) for name in COLUMNS}
    for stream in streams:
        stream.close()
    assert 45 * 2**20 < grown["resident_bytes"] < 60 * 2**20
    assert abs(grown["allocated_bytes"]) < 5 * 2**20
    assert grown["open_files"] == 3
    assert grown["folder_bytes"] == 1234
    assert 0 < grown["cpu_seconds"] < 10
    held.close()


def test_memory_in_use_is_what_was_asked_for_and_not_yet_given_back(tmp_path: Path) -> None:
    def mebibytes() -> float:
        return (usage(tmp_path)["allocated_bytes"] or 0) / 2**20

    before = mebibytes()
    held = bytearray(100 * 2**20)
    assert 95 < mebibytes() - before < 105
    del held
    assert abs(mebibytes() - before) < 5
