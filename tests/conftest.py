import gc
from pathlib import Path

import pytest

from tests import quick_files, quick_hydra, quick_kernels

TESTS = Path(__file__).parent

quick_files.use()
quick_hydra.use()
quick_kernels.use()


LONGEST = (
    *("learn/test_killed", "view/test_browser", "scene/test_shipped_assets"),
    *("render/test_shipped_scenes", "scene/test_reach", "learn/test_multirun"),
    *("gpu/test_graphs", "render/test_recorded_scene", "docs/test_tutorials"),
    *("analysis/test_page", "methods/anf/test_runs", "view/test_export"),
    *("studies/gpu_check/test_gpu_check", "learn/test_interruption", "learn/test_resume"),
    "scene/test_updates_in_kernels",
)
"""Files that take half a minute and more. They begin first, so that none is left alone at the end.
"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    files = [TESTS / f"{name}.py" for name in LONGEST]
    items.sort(key=lambda item: files.index(item.path) if item.path in files else len(files))


def pytest_collection_finish() -> None:
    """What the tests' imports made is not looked at again by every garbage collection.

    It is half a million objects, and each renderer that is made collects twice: a third of the
    time of the tests that render.
    """
    gc.collect()
    gc.freeze()
