"""The tutorials, as a reader follows them: from an empty folder, block by block."""

import json
import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import LONG, ROOT, blocks
from tests.learn.command_line import environment
from tests.warm import finish, start_module

TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))


def reader(folder: Path) -> dict[str, str]:
    """The environment of someone who has installed the program."""
    programs = folder / "bin"
    programs.mkdir()
    ngi = programs / "ngi"
    # PYTHONPATH=. of the tutorials replaces the checkout's path; `-m` looks where it is started.
    ngi.write_text(
        f'#!/bin/sh\nPYTHONPATH="$PYTHONPATH:{ROOT}" exec "{sys.executable}" -m ngi "$@"\n'
    )
    ngi.chmod(0o755)
    known = environment(folder)
    known["MPLBACKEND"] = "Agg"  # a notebook leaves the choice to where it is shown
    return {**known, "PATH": os.pathsep.join([str(programs), known["PATH"]])}


def run(command: list[str], *, cwd: Path, env: dict[str, str]) -> None:
    answer = subprocess.run(
        command, cwd=cwd, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert answer.returncode == 0, f"{command[-1]}\n{answer.stdout}"


def follow(text: str, *, cwd: Path, env: dict[str, str]) -> None:
    """Line by line; `ngi` alone begins in a process that need not import everything first."""
    for line in filter(None, text.splitlines()):
        words = re.fullmatch(r"(?:PYTHONPATH=(\S+) )?ngi ([^|&;<>$]*)", line)
        if words is None:
            run(["bash", "-e", "-c", line], cwd=cwd, env=env)
            continue
        path = os.pathsep.join([words[1] or env["PYTHONPATH"], str(ROOT)])
        output = cwd.parent / "output"
        started = start_module(
            "ngi",
            *shlex.split(words[2], comments=True),
            folder=cwd,
            environment={**env, "PYTHONPATH": path},
            output=output,
        )
        status, printed = finish(started, output, seconds=300)
        assert status == 0, f"{line}\n{printed}"


def composed_only(text: str) -> str:
    """Commands that train, each shown instead of run: the configuration of its first job."""
    lines = [line for line in text.splitlines() if "ngi train" in line]
    first = [re.sub(r"(?<==)([^ ,]+),\S+", r"\1", line.replace(" -m ", " ")) for line in lines]
    return "\n".join(line.replace("ngi train", "ngi train --cfg job") for line in first)


def code_of(notebook: Path) -> list[str]:
    """Its cells of code, in order."""
    cells = json.loads(notebook.read_text())["cells"]
    return [cell["source"] for cell in cells if cell["cell_type"] == "code"]


def test_the_notebook_is_that_of_its_page() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "notebook.py"))
    page, notebook = tool["PAGE"], tool["NOTEBOOK"]
    assert notebook.read_text() == tool["text"](page.read_text()), "run tools/notebook.py"
    python = [block.text.strip() for block in blocks(page) if block.language == "python"]
    assert code_of(notebook) == python


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_works_as_it_stands_there(page: Path, tmp_path: Path) -> None:
    place, environment = tmp_path / "empty", reader(tmp_path)
    place.mkdir()
    script = ""
    for block in blocks(page):
        if block.is_file:
            file = place / str(block.title)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text)
        elif block.language == "sh":
            text = composed_only(block.text) if block.title == LONG else block.text
            follow(text, cwd=place, env=environment)
        elif block.language == "python":
            script += block.text
    notebook = page.with_suffix(".ipynb")
    if notebook.exists():
        script = "\n".join(code_of(notebook))
    if script:
        run([sys.executable, "-c", script], cwd=place, env=environment)
