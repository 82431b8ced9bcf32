from dataclasses import dataclass

import numpy as np
import pytest
import torch
from torch import nn

from ngi.denoise import denoised, guides
from ngi.learn import PatchSamples, network_of, seeded
from ngi.learn.glimpses import sparse
from ngi.patches import BufferLayout, MovingPoints
from ngi.render import AnalyticRenderer

from .moving_camera import SCENE_VARIABLES, MovingCamera


@dataclass
class Halving:
    """A denoiser whose result is known."""

    calls: int = 0

    def __call__(self, radiance, albedo, normal) -> torch.Tensor:
        self.calls += 1
        assert radiance.shape == albedo.shape == normal.shape
        return radiance / 2


def states(renderer, count=3) -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    return torch.rand(count, renderer.dimensions + 2, generator=generator)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_targets_are_the_mean_of_traced_and_denoised_radiance(share) -> None:
    renderer = AnalyticRenderer(dimensions=3, patch_size=16)
    denoiser = Halving()
    samples = PatchSamples(renderer=renderer, denoiser=denoiser, traced_share=share)
    plain = renderer.render_patches(states(renderer), resolution=64, seed=1)
    job = samples.start_patches(states(renderer), resolution=64, seed=1)
    assert denoiser.calls == 0  # work is done when it is asked for
    assert job.done()
    result = job.result()
    assert job.result() is result
    assert denoiser.calls == 3
    expected = (share + (1 - share) / 2) * plain.log_radiance.expm1()
    torch.testing.assert_close(result.log_radiance.expm1(), expected, atol=1e-6, rtol=1e-5)
    assert torch.equal(result.buffers, plain.buffers)
    assert result.paths == plain.paths


@pytest.mark.parametrize(("patch_size", "border"), [(16, 8), (4, 3)])
def test_a_denoiser_is_given_what_a_mirror_at_the_edges_would_show(patch_size, border) -> None:
    """As NumPy continues images; a patch of 4 pixels has no more than 3 to show."""
    renderer = AnalyticRenderer(dimensions=3, patch_size=patch_size)
    traced = renderer.render_patches(states(renderer), resolution=64, seed=1)
    given = []

    def keep(radiance, albedo, normal) -> torch.Tensor:
        given.append((radiance, albedo, normal))
        return radiance

    result = denoised(traced, denoiser=keep, traced_share=0.0, layout=renderer.layout)
    torch.testing.assert_close(result.log_radiance, traced.log_radiance)
    assert len(given) == 3
    for patch, buffers, seen in zip(traced.log_radiance, traced.buffers, given, strict=True):
        for image, shown in zip(
            (patch.expm1(), *guides(buffers, renderer.layout)), seen, strict=True
        ):
            wanted = np.pad(image.numpy(), [(border, border)] * 2 + [(0, 0)], mode="reflect")
            assert shown.is_contiguous()
            torch.testing.assert_close(shown, torch.from_numpy(wanted))


def test_of_a_denoised_patch_only_the_traced_share_is_noise() -> None:
    """What is left of (a - b) / 2 where the mean is half traced."""
    renderer = AnalyticRenderer(
        dimensions=3, patch_size=16, samples_per_pixel=2, halves=True, noise=0.3
    )
    halves, both = (
        PatchSamples(renderer=renderer, denoiser=denoiser, traced_share=0.5)
        .start_patches(states(renderer), resolution=64, seed=1)
        .result()
        for denoiser in (None, Halving())
    )
    assert halves.first_half is not None
    assert both.first_half is not None
    noise = halves.first_half.expm1() - halves.log_radiance.expm1()
    left = both.first_half.expm1() - both.log_radiance.expm1()
    torch.testing.assert_close(left, noise / 2, atol=1e-5, rtol=1e-4)
    assert noise.abs().mean() > 0.01


def test_negative_radiance_of_a_denoiser_is_none() -> None:
    renderer = AnalyticRenderer(dimensions=1, patch_size=16)
    traced = renderer.render_patches(states(renderer), resolution=64, seed=1)
    result = denoised(
        traced,
        denoiser=lambda radiance, *_: radiance - 100,
        traced_share=0.0,
        layout=BufferLayout(),
    )
    assert (result.log_radiance == 0).all()


def test_a_share_that_is_none_is_named() -> None:
    with pytest.raises(ValueError, match=r"data\.traced_share is 1\.5; expected 0 to 1"):
        PatchSamples(renderer=AnalyticRenderer(dimensions=1, patch_size=16), traced_share=1.5)


def test_what_only_places_the_camera_is_left_out() -> None:
    renderer = MovingCamera(patch_size=16)
    samples = PatchSamples(renderer=renderer, camera=False)
    patches = samples.blank(2)
    v = torch.rand(renderer.dimensions)
    patches.scene_vector[1] = v
    (buffers, seen), _ = samples.example(patches)
    assert samples.dimensions == SCENE_VARIABLES + 2  # the sampler still draws all of them
    assert samples.network_arguments["scene_dimensions"] == SCENE_VARIABLES
    assert torch.equal(seen[1], v[:SCENE_VARIABLES])
    assert torch.equal(samples.test_inputs(v, torch.zeros(64, 64, 1))[0], v[:SCENE_VARIABLES])
    assert buffers is patches.buffers


def test_a_network_gets_what_it_asks_for() -> None:
    renderer = MovingCamera(patch_size=16)
    renderer.moving_points = MovingPoints(
        torch.rand(1, 3, renderer.dimensions), torch.rand(1, 3), torch.ones(3)
    )
    samples = PatchSamples(renderer=renderer, camera=False)
    given = {}

    def paper(*, layout, scene_dimensions) -> nn.Module:
        given.update(layout=layout, scene_dimensions=scene_dimensions)
        return nn.Identity()

    def ours(*, layout, scene_dimensions, moving) -> nn.Module:
        given["moving"] = moving
        return paper(layout=layout, scene_dimensions=scene_dimensions)

    network_of(samples, seeded(paper, seed=0))
    assert given == {"layout": renderer.layout, "scene_dimensions": SCENE_VARIABLES}
    network_of(samples, seeded(ours, seed=0))
    expected = renderer.moving_points.weight[:, :, :SCENE_VARIABLES]
    assert torch.equal(given["moving"].weight, expected)


def test_a_network_that_takes_anything_is_given_everything() -> None:
    given: dict[str, object] = {}

    def mine(*, extra: int = 0, **rest: object) -> nn.Module:
        given.update(rest)
        return nn.Linear(1, 1 + extra)

    samples = PatchSamples(renderer=MovingCamera(patch_size=16))
    network_of(samples, mine)
    assert given.keys() == {"layout", "scene_dimensions", "moving"}


def test_the_paper_gives_all_of_v() -> None:
    samples = PatchSamples(renderer=MovingCamera(patch_size=16))
    v = torch.rand(SCENE_VARIABLES + 2)
    assert samples.network_arguments["scene_dimensions"] == SCENE_VARIABLES + 2
    assert torch.equal(samples.test_inputs(v, torch.zeros(64, 64, 1))[0], v)


def test_centred_patches_are_seen_and_traced_around_their_positions() -> None:
    renderer = AnalyticRenderer(dimensions=1, patch_size=16)
    samples = PatchSamples(renderer=renderer, centred=True)
    states = torch.tensor([[0.5, 0.0, 0.7], [0.5, 0.25, 0.25], [0.5, 0.5, 1.0]])
    image = renderer.image_buffers(states[0, :1], resolution=64)
    patches = samples.start_patches(states, resolution=64, seed=0).result().buffers
    for patch, (x, y) in zip(patches, [(0, 37), (8, 8), (24, 48)], strict=True):
        torch.testing.assert_close(patch, image[y : y + 16, x : x + 16])
    seen, _ = samples.glimpses(states, resolution=64)
    torch.testing.assert_close(seen, sparse(patches))
