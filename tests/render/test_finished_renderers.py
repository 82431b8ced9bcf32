"""A renderer that is not used any more takes nothing from those that come after it."""

import gc
import weakref

import pytest

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from tests.render.box import BOX


def test_a_renderer_that_only_a_cycle_holds_is_gone_when_the_next_one_is_made() -> None:
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    gc.disable()  # whether it would come by itself depends on what else was allocated
    try:
        holder: dict[str, object] = {}
        renderer = MitsubaRenderer(scene=read_scene(BOX), backend="llvm", patch_size=8)
        holder["self"], holder["renderer"] = holder, renderer
        finished = weakref.ref(renderer)
        del holder, renderer
        assert finished() is not None
        MitsubaRenderer(scene=read_scene(BOX), backend="llvm", patch_size=8)
        assert finished() is None
    finally:
        gc.enable()
