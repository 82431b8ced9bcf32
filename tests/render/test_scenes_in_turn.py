"""A sweep renders one scene after another in one process."""

import gc
from collections.abc import Iterator

import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes


@pytest.fixture
def no_garbage_collection() -> Iterator[None]:
    gc.disable()
    yield
    gc.enable()


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
@pytest.mark.usefixtures("no_garbage_collection")
def test_scenes_can_be_rendered_in_turn() -> None:
    means: dict[str, list[float]] = {}
    for name in ("sphere-caustic", "sphere-caustic", "mirror", "sphere-caustic"):
        renderer = MitsubaRenderer(
            scene=read_scene(**scenes()[name]), backend="llvm", patch_size=8, samples_per_pixel=4
        )
        generator = torch.Generator().manual_seed(0)
        renderer.render_image(
            torch.rand(renderer.dimensions), resolution=16, samples_per_pixel=4, seed=0
        )
        states = torch.rand(2, renderer.dimensions + 2, generator=generator)
        patches = renderer.render_patches(states, resolution=64, seed=1)
        means.setdefault(name, []).append(patches.log_radiance.mean().item())
    assert len(set(means["sphere-caustic"])) == 1
    assert means["mirror"][0] != means["sphere-caustic"][0]
