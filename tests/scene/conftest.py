from collections.abc import Callable
from pathlib import Path

import pytest

from tests.scene.stage import write_assets, write_scene


@pytest.fixture(scope="session")
def assets(tmp_path_factory) -> Path:
    """A folder with the meshes and pictures of the tests' scenes."""
    folder = tmp_path_factory.mktemp("assets")
    write_assets(folder)
    return folder


@pytest.fixture
def make_scene(assets, tmp_path) -> Callable[..., Path]:
    """Makes folders with scenes, see `tests.scene.stage.write_scene`."""

    def make(name, variables, **arguments) -> Path:
        folder = tmp_path / f"scene_{len(list(tmp_path.iterdir()))}"
        return write_scene(folder, assets, name, variables, **arguments)

    return make
