"""Open Image Denoise on closed formulas; OptiX where there is a GPU."""

import os
import sys

import pytest
import torch

from ngi.denoise import OpenImageDenoise, OptixDenoise, denoised, guides
from ngi.evaluate import mape
from ngi.machine.backend import cuda_problem
from ngi.methods.path_tracing import PathTracing
from ngi.render import AnalyticRenderer

V = torch.tensor([0.3, 0.6, 0.9])
SIZE = 64


@pytest.fixture
def oidn() -> OpenImageDenoise:
    pytest.importorskip("pyoidn", reason="the extra 'denoise' is missing")
    return OpenImageDenoise()


def closed_form(denoiser: object) -> tuple[PathTracing, torch.Tensor]:
    renderer = AnalyticRenderer(dimensions=3, patch_size=16, noise=1.0)
    tracing = PathTracing(
        renderer=renderer,
        denoiser=denoiser,  # type: ignore[arg-type]
        samples_per_pixel=8,
        seed=0,
    )
    return tracing, renderer.whole_image(V, SIZE)[1]


def test_most_of_the_noise_goes_and_the_brightness_stays(oidn: OpenImageDenoise) -> None:
    tracing, clean = closed_form(oidn)
    noisy = tracing.trace(V, resolution=SIZE)
    buffers = tracing.renderer.image_buffers(V, resolution=SIZE)
    kept = noisy.clone()
    result = tracing.denoise(noisy, buffers)
    assert mape(result, clean, 0.01) < 0.25 * mape(noisy, clean, 0.01)
    assert result.mean().item() == pytest.approx(clean.mean().item(), rel=0.02)
    assert torch.equal(tracing.denoise(noisy, buffers), result)
    assert torch.equal(noisy, kept)


def test_what_is_faster_takes_less_noise_off(oidn: OpenImageDenoise) -> None:
    tracing, clean = closed_form(OpenImageDenoise(quality="fast"))
    noisy = tracing.trace(V, resolution=SIZE)
    buffers = tracing.renderer.image_buffers(V, resolution=SIZE)
    best = mape(oidn(noisy, *guides(buffers, tracing.renderer.layout)), clean, 0.01)
    assert best < mape(tracing.denoise(noisy, buffers), clean, 0.01) < mape(noisy, clean, 0.01)


def test_a_quality_that_is_none_is_named() -> None:
    with pytest.raises(ValueError, match="quality: 'best': choose one of high, balanced, fast"):
        OpenImageDenoise(quality="best")


@pytest.mark.parametrize(("probability", "shown"), [(0.5, (0.9, 1.1)), (0.001, (0.0, 0.2))])
def test_a_caustic_that_paths_rarely_find_is_not_shown(
    oidn: OpenImageDenoise, probability: float, shown: tuple[float, float]
) -> None:
    """A disc of light that one path in two finds is kept; of one in a thousand little is left.

    The mean over many images is the same: what is lost is in no single image.
    """
    tracing, clean = closed_form(oidn)
    buffers = tracing.renderer.image_buffers(V, resolution=SIZE)
    y, x = torch.meshgrid(*[torch.linspace(-1, 1, SIZE)] * 2, indexing="ij")
    disc = (x**2 + y**2 < 0.1)[..., None]
    paths = torch.full((*disc.shape[:2], 1), 8.0)
    generator = torch.Generator().manual_seed(0)
    found = torch.binomial(paths, torch.tensor(probability), generator=generator) / paths
    result = tracing.denoise(clean + disc * found / probability, buffers)
    added = (result - clean)[disc.squeeze(-1)].mean().item()
    assert shown[0] <= added <= shown[1]


def test_small_patches_lose_little_for_being_small(oidn: OpenImageDenoise) -> None:
    """As they were traced, without what a mirror shows, they are left with a sixth more error."""
    renderer = AnalyticRenderer(dimensions=3, patch_size=16, samples_per_pixel=8, noise=1.0)
    states = torch.rand(32, 5, generator=torch.Generator().manual_seed(0))
    traced = renderer.render_patches(states, resolution=SIZE, seed=0)
    clean = AnalyticRenderer(dimensions=3, patch_size=16).render_patches(
        states, resolution=SIZE, seed=0
    )
    together = denoised(traced, denoiser=oidn, traced_share=0.0, layout=renderer.layout)
    alone = torch.stack(
        [
            oidn(patch.expm1(), *guides(buffers, renderer.layout)).clamp_min(0).log1p()
            for patch, buffers in zip(traced.log_radiance, traced.buffers, strict=True)
        ]
    )
    error = (together.log_radiance - clean.log_radiance).abs().mean()
    error_alone = (alone - clean.log_radiance).abs().mean()
    assert error < 0.9 * error_alone


@pytest.mark.parametrize(("given", "threads"), [({}, "3"), ({"OIDN_NUM_THREADS": "5"}, "5")])
def test_a_run_that_shares_a_machine_denoises_on_its_part_of_it(
    given: dict[str, str], threads: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On no cores in particular: all runs would be pinned to the same ones."""
    pytest.importorskip("pyoidn", reason="the extra 'denoise' is missing")
    monkeypatch.setattr(os, "environ", {"OMP_NUM_THREADS": "3", **given})
    OpenImageDenoise()
    assert os.environ["OIDN_NUM_THREADS"] == threads
    assert os.environ["OIDN_SET_AFFINITY"] == "0"


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(RuntimeError, match=r"pip install .* -e .*\[denoise\]"):
        OpenImageDenoise()


def test_optix_takes_most_of_the_noise() -> None:
    if (problem := cuda_problem()) is not None:
        with pytest.raises(RuntimeError, match="path_tracing=optix does not work here"):
            OptixDenoise()
        pytest.skip(problem)
    tracing, clean = closed_form(OptixDenoise())
    noisy = tracing.trace(V, resolution=SIZE)
    result = tracing.denoise(noisy, tracing.renderer.image_buffers(V, resolution=SIZE))
    assert mape(result, clean, 0.01) < 0.5 * mape(noisy, clean, 0.01)
