"""Frames of path tracing, on closed formulas with noise of known size."""

import pytest
import torch
from torch import Tensor

from ngi.denoise import guides
from ngi.methods.path_tracing import PathTracing, largest_fitting
from ngi.methods.path_tracing.frame_time import MOST_SAMPLES
from ngi.patches import BufferLayout
from ngi.render import AnalyticRenderer

V = torch.tensor([0.3, 0.6, 0.9])
SIZE = 48


def path_tracing(**changes: object) -> PathTracing:
    renderer = AnalyticRenderer(dimensions=3, patch_size=16, noise=0.5)
    arguments = {"renderer": renderer, "denoiser": None, "samples_per_pixel": 4, "seed": 0}
    return PathTracing(**{**arguments, **changes})  # type: ignore[arg-type]


def test_noise_is_that_of_its_samples_and_new_in_every_frame() -> None:
    tracing = path_tracing()
    _, clean = tracing.renderer.whole_image(V, SIZE)  # type: ignore[attr-defined]
    first, second = (tracing.trace(V, resolution=SIZE) / clean - 1 for _ in range(2))
    for error in (first, second):
        assert error.std().item() == pytest.approx(0.5 / 4**0.5, rel=0.05)
    correlation = torch.corrcoef(torch.stack([first.flatten(), second.flatten()]))[0, 1]
    assert abs(correlation.item()) < 0.05


def test_the_same_seed_gives_the_same_frames_and_another_one_others() -> None:
    one, again, other = path_tracing(), path_tracing(), path_tracing(seed=1)
    for _ in range(3):
        frame = one.trace(V, resolution=8)
        assert torch.equal(again.trace(V, resolution=8), frame)
        assert not torch.equal(other.trace(V, resolution=8), frame)


def test_seeds_are_not_those_of_references(tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    from ngi.evaluate import EvaluationProtocol, ReferenceCache

    seeds: list[int] = []
    trace = AnalyticRenderer.render_image

    def watched(self: AnalyticRenderer, v: Tensor, *, seed: int, **rest: int) -> Tensor:
        seeds.append(seed)
        return trace(self, v, seed=seed, **rest)

    monkeypatch.setattr(AnalyticRenderer, "render_image", watched)
    tracing = path_tracing()
    tracing.trace(V, resolution=32)
    protocol = EvaluationProtocol(
        name="test",
        resolution=32,
        low_discrepancy_frames=1,
        target_noise=1e-6,
        samples_per_pass=1,
        maximum_samples=20,
    )
    ReferenceCache(tmp_path).get(tracing.renderer, protocol, V)
    assert len(seeds) == len(set(seeds)) == 21


def test_pixels_without_a_number_are_black_and_counted() -> None:
    tracing = path_tracing()
    trace = tracing.renderer.render_image

    def broken(*arguments: object, **options: object) -> Tensor:
        image = trace(*arguments, **options)  # type: ignore[arg-type]
        image[0, 1, 2], image[3, 4, 0] = torch.nan, torch.inf
        return image

    tracing.renderer.render_image = broken  # type: ignore[method-assign]
    frame = tracing.trace(V, resolution=8)
    assert tracing.pixels_masked == 2
    assert frame.isfinite().all()
    assert torch.equal((frame == 0).all(dim=-1).nonzero(), torch.tensor([[0, 1], [3, 4]]))


def test_the_denoiser_gets_linear_radiance_albedo_and_normal() -> None:
    seen = {}

    def twice(radiance: Tensor, albedo: Tensor, normal: Tensor) -> Tensor:
        seen.update(radiance=radiance, albedo=albedo, normal=normal)
        return 2 * radiance

    tracing = path_tracing(denoiser=twice)
    buffers, _ = tracing.renderer.whole_image(V, SIZE)  # type: ignore[attr-defined]
    predicted = torch.expm1(tracing.predict(buffers, *tracing.test_inputs(V, buffers)))
    torch.testing.assert_close(predicted, 2 * seen["radiance"])
    assert torch.equal(seen["radiance"], path_tracing().trace(V, resolution=SIZE))
    assert torch.equal(seen["albedo"], buffers[..., tracing.renderer.layout.slice("albedo")])
    assert torch.equal(seen["normal"], torch.tensor([0.0, 0.0, 1.0]).expand(SIZE, SIZE, 3))
    torch.testing.assert_close(path_tracing(denoiser=twice).radiance(V, resolution=SIZE), predicted)


def test_what_a_scene_does_not_carry_guides_nothing() -> None:
    albedo, normal = guides(torch.rand(4, 5, 3), BufferLayout(("position",)))
    assert torch.equal(albedo, torch.ones(4, 5, 3))
    assert torch.equal(normal, torch.zeros(4, 5, 3))
    missed = torch.zeros(4, 5, BufferLayout().channels)
    assert torch.equal(guides(missed, BufferLayout())[1], torch.zeros(4, 5, 3))


@pytest.mark.parametrize("covered", [1.0, 0.75, 0.0625])
def test_the_normal_of_a_pixel_that_a_surface_covers_in_part_is_that_share_of_its_own(
    covered: float,
) -> None:
    """Buffers are means over a pixel's rays, and 0 for those that hit nothing."""
    layout = BufferLayout()
    normal, outgoing = (torch.tensor(n) for n in ([0.6, 0.0, -0.8], [0.0, -1.0, 0.0]))
    buffers = torch.zeros(4, 5, layout.channels)
    buffers[..., layout.slice("normal")] = covered * (normal / 2 + 0.5)
    buffers[..., layout.slice("outgoing")] = covered * outgoing
    found = guides(buffers, layout)[1]
    torch.testing.assert_close(found, (covered * normal).expand(4, 5, 3))


def test_rays_that_mirrors_lead_apart_are_not_taken_for_missed_ones() -> None:
    layout = BufferLayout().adding(["throughput"])
    normal = torch.tensor([0.6, 0.0, -0.8])
    buffers = torch.zeros(4, 5, layout.channels)
    buffers[..., layout.slice("normal")] = normal / 2 + 0.5
    buffers[..., layout.slice("outgoing")] = 0.25
    buffers[..., layout.slice("throughput")] = 0.9
    torch.testing.assert_close(guides(buffers, layout)[1], normal.expand(4, 5, 3))


@pytest.mark.parametrize("largest", [1, 2, 3, 7, 8, 100, 1000])
def test_the_largest_number_that_fits_is_found(largest: int) -> None:
    tried: list[int] = []

    def fits(number: int) -> bool:
        tried.append(number)
        return number <= largest

    assert largest_fitting(fits) == largest
    assert len(tried) == len(set(tried)) <= 2 * largest.bit_length() + 1


def test_at_least_one_sample_and_no_end_of_them() -> None:
    assert largest_fitting(lambda _: False) == 1
    assert largest_fitting(lambda _: True) == MOST_SAMPLES
