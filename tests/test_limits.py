"""The sizes that files and functions of the program keep to (CONTRIBUTING.md)."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = [file for package in ("ngi", "analysis") for file in (ROOT / package).rglob("*.py")]

MOST_FILE_LINES = 300
MOST_FUNCTION_LINES = 50
MOST_ARGUMENTS = 8


def functions(source: str) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def argument_count(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Those that a caller gives: without `self` and `cls`."""
    given = function.args
    names = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len([name for name in names if name not in ("self", "cls")])


def too_long(source: str) -> list[str]:
    """The functions with too many lines, the docstring included."""
    lines = [(f.name, (f.end_lineno or 0) - f.lineno + 1) for f in functions(source)]
    return [f"{name}: {count} lines" for name, count in lines if count > MOST_FUNCTION_LINES]


def too_wide(source: str) -> list[str]:
    """The functions with too many arguments."""
    counts = [(function.name, argument_count(function)) for function in functions(source)]
    return [f"{name}: {count} arguments" for name, count in counts if count > MOST_ARGUMENTS]


def test_a_file_has_at_most_300_lines() -> None:
    lines = {str(file.relative_to(ROOT)): len(file.read_text().splitlines()) for file in FILES}
    assert {name: count for name, count in lines.items() if count > MOST_FILE_LINES} == {}


@pytest.mark.parametrize("find", [too_long, too_wide])
def test_a_function_fits_a_screen_and_takes_few_arguments(find) -> None:
    found = [f"{file.relative_to(ROOT)}: {one}" for file in FILES for one in find(file.read_text())]
    assert found == []


def test_what_is_too_large_is_noticed() -> None:
    body = "    pass\n"
    assert too_long("def f():\n" + 49 * body) == []
    assert too_long("def f():\n" + 50 * body + "def f(): pass\n") == ["f: 51 lines"]
    assert too_wide("class C:\n  def f(self, a, b, c, d, /, e, f, *, g, h): pass\n") == []
    assert too_wide("def f(a, b, c, d, /, e, f, g, *, h, i): pass\n") == ["f: 9 arguments"]
