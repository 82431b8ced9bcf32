"""The rooms of the house and what each may touch (docs/explanation/method.md)."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def imports(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def imported_below(folder: str) -> set[str]:
    return {name for file in (ROOT / folder).rglob("*.py") for name in imports(file)}


def starts_with(names: set[str], *prefixes: str) -> set[str]:
    return {n for n in names for p in prefixes if n == p or n.startswith(p + ".")}


def test_mitsuba_is_imported_in_one_place() -> None:
    importers = {
        str(file.relative_to(ROOT))
        for file in (ROOT / "ngi").rglob("*.py")
        if starts_with(set(imports(file)), "mitsuba", "drjit")
    }
    assert importers == {"ngi/backend.py"}


@pytest.mark.parametrize("room", ["ngi/explore", "ngi/reuse"])
def test_exploration_and_reuse_know_tensors_only(room: str) -> None:
    own = room.replace("/", ".")
    foreign = {n for n in starts_with(imported_below(room), "ngi") if not n.startswith(own)}
    assert foreign <= {"ngi.patches", "ngi.durable"}
    assert not starts_with(imported_below(room), "lightning", "hydra", "omegaconf")


def test_models_know_no_renderer_and_no_training() -> None:
    known = starts_with(imported_below("ngi/models"), "ngi")
    assert {n for n in known if not n.startswith("ngi.models")} <= {"ngi.patches"}


def test_no_constructor_takes_a_configuration() -> None:
    users = {
        str(file.relative_to(ROOT))
        for file in (ROOT / "ngi").rglob("*.py")
        if starts_with(set(imports(file)), "hydra", "omegaconf")
    }
    assert users == {
        "ngi/train.py",
        "ngi/build.py",
        "ngi/config_values.py",
        "ngi/configuration.py",
        "ngi/costs.py",
        "ngi/denoise/run.py",
        "ngi/exploration_map/training.py",
        "ngi/noise.py",
        "ngi/options.py",
        "ngi/stability/training_run.py",
        "ngi/view/run_settings.py",
    }


def test_analysis_reads_files_only() -> None:
    assert not starts_with(imported_below("analysis"), "ngi", "mitsuba", "drjit", "torch")


def test_help_does_not_wait_for_pytorch() -> None:
    code = "import sys, ngi.train; print([m for m in ('torch', 'mitsuba') if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert answer.stdout.strip() == "[]", answer.stderr
