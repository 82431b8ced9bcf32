"""A report's files are whole or as they were, and the one that could not be written is named."""

import ast
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from resource import RLIMIT_FSIZE, getrlimit, setrlimit

import pytest

from analysis.files import write
from analysis.report import main

ANALYSIS = Path(__file__).parents[2] / "analysis"


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Longer ones can not be written, as on a disk that is full."""
    soft, hard = getrlimit(RLIMIT_FSIZE)
    setrlimit(RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        setrlimit(RLIMIT_FSIZE, (soft, hard))


def contents(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_a_file_that_can_not_be_written_stays_as_it_was_and_is_named(tmp_path: Path) -> None:
    write(tmp_path / "page.html", "old")
    before = contents(tmp_path)
    with files_of_at_most(10), pytest.raises(OSError, match=r"page\.html'$"):
        write(tmp_path / "page.html", "new" * 10)
    assert contents(tmp_path) == before
    write(tmp_path / "page.html", "ö")
    assert contents(tmp_path) == {tmp_path / "page.html": "ö".encode()}


@pytest.mark.usefixtures("undrawn")
def test_a_report_that_the_disk_has_no_room_for_leaves_the_old_one(
    make_run, tmp_path, capsys
) -> None:
    make_run()
    report = tmp_path / "report"
    arguments = [str(tmp_path / "runs"), "--output", str(report)]
    assert main(arguments) == 0
    (report / "index.html").write_text("<title>old</title>" * 1000)
    before = contents(report)
    for size in (50, 10_000):
        capsys.readouterr()
        with files_of_at_most(size):
            assert main(arguments) == 1
        assert contents(report) == before
    assert f"'{report / 'index.html'}'" in capsys.readouterr().err


def test_no_other_module_writes() -> None:
    writers = {
        f"{file.relative_to(ANALYSIS)}: {node.func.attr}"
        for file in ANALYSIS.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        if node.func.attr in ("write_text", "write_bytes")
        or (node.func.attr == "to_csv" and node.args)
    }
    assert writers == {"files.py: write_bytes"}
