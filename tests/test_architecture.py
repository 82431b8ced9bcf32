"""The rooms of the house and what each may touch (docs/explanation/method.md)."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ROOMS = (
    *("patches", "machine", "files", "scene", "render", "denoise", "explore", "reuse", "models"),
    *("evaluate", "clock", "learn", "config", "methods", "view"),
)
"""From the ground up: each may import those before it, and itself."""

COMMANDS = ("train", "commands")
"""Entry points, which stand on all the rooms."""

STUDIES = ("studies",)
"""What measures the program: it may import everything above."""

DOORS = ("cli", "__main__")
"""The command line, which imports the module of a verb when it is asked for."""

STOREYS = {
    **{name: number for number, name in enumerate(ROOMS)},
    **{
        name: len(ROOMS) + number
        for number, names in enumerate((COMMANDS, STUDIES, DOORS))
        for name in names
    },
}

WITH_MITSUBA = ("machine", "scene", "render", "denoise", "studies")
"""Who may use mitsuba and drjit, by way of `ngi.machine.backend`."""
ONLY_CHOOSE_THE_VARIANT = {"ngi.view.describe"}


def modules(*packages: str, root: Path = ROOT) -> dict[str, Path]:
    """By dotted name."""
    found = {}
    for package in packages:
        for file in (root / package).rglob("*.py"):
            parts = file.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


@cache
def imports(file: Path) -> tuple[str, ...]:
    """All that a file imports, wherever it does, for type checkers only too.

    `from a import b` is a.b.
    """
    found: list[str] = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: name the package that is imported from"
            found += [f"{node.module}.{alias.name}" for alias in node.names]
    return tuple(found)


def imported_below(folder: str) -> set[str]:
    return {name for file in (ROOT / folder).rglob("*.py") for name in imports(file)}


def starts_with(names: set[str], *prefixes: str) -> set[str]:
    return {n for n in names for p in prefixes if n == p or n.startswith(p + ".")}


def import_graph(files: dict[str, Path]) -> dict[str, set[str]]:
    """Each module with those of them that it imports."""

    def known(name: str) -> str:
        while name and name not in files:
            name = name.rpartition(".")[0]
        return name

    return {
        module: {known(name) for name in imports(file)} - {"", module}
        for module, file in files.items()
    }


def storey(module: str) -> int:
    """-1 for `ngi` itself, which holds the version and imports nothing."""
    if module == "ngi":
        return -1
    return STOREYS[module.split(".")[1]]


def upward(graph: dict[str, set[str]]) -> list[str]:
    """Imports that do not lead downward; those inside a room are its own affair."""
    return [
        f"{module} -> {other}"
        for module, others in graph.items()
        for other in others
        if storey(module) <= storey(other) and module.split(".")[1] != other.split(".")[1]
        if module.split(".")[1] not in DOORS
    ]


def circle(graph: dict[str, set[str]]) -> list[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_every_arrow_points_downward() -> None:
    assert upward(import_graph(modules("ngi"))) == []


def test_an_arrow_upward_is_noticed() -> None:
    assert upward({"ngi.scene.folder": {"ngi.render.exr"}, "ngi.train": {"ngi.studies.noise"}}) == [
        "ngi.scene.folder -> ngi.render.exr",
        "ngi.train -> ngi.studies.noise",
    ]


def test_everything_is_in_a_room() -> None:
    loose = {file.stem for file in (ROOT / "ngi").glob("*.py")}
    assert loose == {"__init__", "__main__", "cli", "patches", "train"}


def test_imports_make_no_circle() -> None:
    assert circle(import_graph(modules("ngi"))) == []
    assert circle(import_graph(modules("analysis"))) == []


def test_a_circle_of_types_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "ngi").mkdir()
    (tmp_path / "ngi" / "bodies.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ngi.parameters import P\n"
    )
    (tmp_path / "ngi" / "parameters.py").write_text("def bodies():\n    import ngi.bodies\n")
    assert set(circle(import_graph(modules("ngi", root=tmp_path)))) == {
        "ngi.bodies",
        "ngi.parameters",
    }


def test_the_program_knows_neither_studies_nor_tests() -> None:
    files = modules("ngi", "analysis")
    measuring = {
        name
        for name, file in files.items()
        if starts_with(set(imports(file)), "ngi.studies") and not name.startswith("ngi.studies")
    }
    assert measuring == set()
    assert not {n for n, file in files.items() if starts_with(set(imports(file)), "tests")}


def test_mitsuba_is_imported_in_one_place() -> None:
    importers = {
        name
        for name, file in modules("ngi").items()
        if starts_with(set(imports(file)), "mitsuba", "drjit")
    }
    assert importers == {"ngi.machine.backend"}


def test_mitsuba_is_used_by_those_who_render() -> None:
    users = {
        name: starts_with(set(imports(file)), "ngi.machine.backend")
        for name, file in modules("ngi").items()
    }
    others = {n: u for n, u in users.items() if u and n.split(".")[1] not in WITH_MITSUBA}
    assert others.keys() == ONLY_CHOOSE_THE_VARIANT
    for used in others.values():
        assert not starts_with(used, "ngi.machine.backend.mi", "ngi.machine.backend.dr")


@pytest.mark.parametrize("room", ["ngi/explore", "ngi/reuse"])
def test_exploration_and_reuse_know_tensors_only(room: str) -> None:
    own = room.replace("/", ".")
    foreign = {n for n in starts_with(imported_below(room), "ngi") if not n.startswith(own)}
    assert foreign == starts_with(foreign, "ngi.patches", "ngi.files.durable")
    assert not starts_with(imported_below(room), "lightning", "hydra", "omegaconf")


def test_models_know_no_renderer_and_no_training() -> None:
    known = starts_with(imported_below("ngi/models"), "ngi")
    foreign = {n for n in known if not n.startswith("ngi.models")}
    assert foreign == starts_with(foreign, "ngi.patches", "ngi.machine.precision")


def test_no_constructor_takes_a_configuration() -> None:
    users = {
        name
        for name, file in modules("ngi").items()
        if starts_with(set(imports(file)), "hydra", "omegaconf")
    }
    assert {name for name in users if not name.startswith("ngi.config.")} == {
        "ngi.studies.costs",
        "ngi.methods.path_tracing.run",
        "ngi.studies.ceiling.__main__",
        "ngi.studies.ceiling.campaign",
        "ngi.studies.ceiling.training",
        "ngi.studies.exploration_map.training",
        "ngi.studies.noise",
        "ngi.studies.stability.training_run",
        "ngi.train",
        "ngi.view.run_settings",
    }


def test_analysis_reads_files_only() -> None:
    assert not starts_with(imported_below("analysis"), "ngi", "mitsuba", "drjit", "torch")


def test_tests_mirror_the_program() -> None:
    rooms = {
        path.relative_to(ROOT / "tests")
        for path in (ROOT / "tests").rglob("*")
        if path.is_dir() and any(path.glob("test_*.py"))
    } - {Path("docs"), Path("fuzz"), Path("gpu"), Path("analysis")}
    assert rooms == {room for room in rooms if (ROOT / "ngi" / room).is_dir()}


def test_help_does_not_wait_for_pytorch() -> None:
    code = (
        "import sys, ngi.train; "
        "print([m for m in ('torch', 'mitsuba', 'scipy') if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert answer.stdout.strip() == "[]", answer.stderr
