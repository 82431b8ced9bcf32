"""Every shipped scene renders at the ends of its variables, is lit, and keeps its camera free."""

import pytest
import torch

from ngi.machine.backend import llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes
from ngi.scene.clearance import camera_problems

NAMES = sorted(set(scenes()) - {"salon-5", "salon-7", "salon-9", "salon-10"})
"""Of the salon's variants only the one that varies everything."""

DARK, TOO_DARK = 0.002, 0.5
"""Radiance below which a pixel is black, and the share of such pixels that is too much."""


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
@pytest.mark.parametrize("name", NAMES)
def test_scene(name) -> None:
    renderer = MitsubaRenderer(
        scene=read_scene(**scenes()[name]), backend="llvm", patch_size=32, samples_per_pixel=8
    )
    dimensions = renderer.dimensions
    v = torch.rand(3, dimensions, generator=torch.Generator().manual_seed(7))
    ends = [torch.full((1, dimensions), value) for value in (0.0, 0.5, 1.0)]
    v = torch.cat([*ends, v, renderer.hard_frames()])
    # A patch of 32 pixels of an image of 32 is the whole image.
    states = torch.cat([v, torch.zeros(len(v), 2)], dim=1)
    patches = renderer.render_patches(states, resolution=32, seed=1)
    assert patches.masked == 0
    assert torch.isfinite(patches.buffers).all()
    radiance = patches.log_radiance.expm1()
    dark = (radiance.amax(dim=-1) < DARK).float().mean(dim=(1, 2))
    assert (dark < TOO_DARK).all(), dark
    assert (radiance.mean(dim=(1, 2, 3)) > 0.01).all()
    position = patches.buffers[..., renderer.layout.slice("position")]
    seen = position.amax(dim=-1) > 0
    assert seen.float().mean() > 0.5, "the camera sees nothing"
    assert (position >= -1e-4).all(), "something lies outside of the scene's bounds"
    assert (position <= 1 + 1e-4).all(), "something lies outside of the scene's bounds"
    assert camera_problems(renderer._scene) == []
    assert torch.isfinite(renderer.image_buffers(v[3], resolution=40)).all()
