from collections.abc import Callable
from pathlib import Path

import pytest

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import HalvesRenderer, MitsubaRenderer
from ngi.scene import read_scene
from tests.render.box import BOX
from tests.render.optics import write_scene
from tests.render.specular_scenes import COLOURS, PAINT


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
            kind = HalvesRenderer if arguments.pop("halves", False) else MitsubaRenderer
            loaded[key] = kind(scene=read_scene(BOX), backend=backend, **arguments)
        return loaded[key]

    return load


@pytest.fixture
def load_specular(tmp_path):
    def load(shapes, *, backend, variables=(PAINT,), max_depth=10, fov=20, **arguments):
        write_scene(
            tmp_path,
            shapes=shapes,
            variables=variables,
            max_depth=max_depth,
            fov=fov,
            image=COLOURS,
        )
        arguments = {"specular": "traced", "buffer_samples": 1, "patch_size": 8} | arguments
        return MitsubaRenderer(scene=read_scene(tmp_path), backend=backend, **arguments)

    return load
