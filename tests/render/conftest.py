from collections.abc import Callable
from pathlib import Path

import pytest

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene

BOX = Path(__file__).parent / "scenes" / "box"


@pytest.fixture(params=["llvm", "scalar"])
def backend(request) -> str:
    if request.param == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    return request.param


@pytest.fixture(scope="session")
def box_folder() -> Path:
    return BOX


@pytest.fixture(scope="session")
def load_box() -> Callable[..., MitsubaRenderer]:
    """Loads the box once per combination of arguments and session."""
    loaded: dict[tuple, MitsubaRenderer] = {}

    def load(backend: str, **arguments: int) -> MitsubaRenderer:
        if backend == "llvm" and (problem := llvm_problem()) is not None:
            pytest.skip(problem)
        key = (backend, *sorted(arguments.items()))
        if key not in loaded:
            loaded[key] = MitsubaRenderer(scene=read_scene(BOX), backend=backend, **arguments)
        return loaded[key]

    return load
