"""Pixels that a path made NaN or Inf: stay so in images, are traced again in patches."""

import numpy as np
import pytest
import torch

from tests.render.box import V, states


def test_pixels_of_an_image_that_are_not_finite_stay_so(load_box, monkeypatch) -> None:
    renderer = load_box("llvm", buffer_samples=1, patch_size=16)
    clean = renderer.render_image(V, resolution=16, samples_per_pixel=8, seed=0)
    radiance = renderer._tracer.radiance
    calls = []

    def broken(window, **arguments):
        calls.append(arguments["seed"])
        image = radiance(window, **arguments)().clone()
        image[3, 4, 1] = np.nan
        image[5, 6] = np.inf
        return lambda: image

    monkeypatch.setattr(renderer._tracer, "radiance", broken)
    image = renderer.render_image(V, resolution=16, samples_per_pixel=8, seed=0)
    assert len(calls) == 1
    assert (~image.isfinite()).nonzero().tolist() == [[3, 4, 1], *([5, 6, i] for i in range(3))]
    finite = image.isfinite()
    assert torch.equal(image[finite], clean[finite])


@pytest.mark.parametrize(("bad_attempts", "masked"), [(1, 0), (2, 1)])
def test_pixels_that_are_not_finite(load_box, monkeypatch, bad_attempts, masked) -> None:
    renderer = load_box("llvm", buffer_samples=1, patch_size=16)
    radiance = renderer._tracer.radiance
    calls = []

    def broken(window, **arguments):
        calls.append(arguments["seed"])
        image = radiance(window, **arguments)().clone()
        if len(calls) <= bad_attempts:
            image[3, 4, 1] = np.nan
        return lambda: image

    monkeypatch.setattr(renderer._tracer, "radiance", broken)
    patches = renderer.render_patches(states(1), resolution=40, seed=0)
    assert (patches.repaired, patches.masked) == (1, masked)
    assert patches.paths == 2 * 16 * 16 * 8
    assert len(set(calls)) == 2
    assert torch.isfinite(patches.log_radiance).all()
    assert bool((patches.log_radiance[0, 3, 4] == 0).all()) == bool(masked)


def test_a_pixel_that_is_not_finite_in_one_half_is_none_in_both(load_box, monkeypatch) -> None:
    renderer = load_box("llvm", buffer_samples=1, patch_size=16, halves=True)
    radiance, calls = renderer._tracer.radiance, []

    def broken(window, **arguments):
        calls.append(arguments["seed"])
        image = radiance(window, **arguments)().clone()
        if len(calls) % 2 == 0:  # the second half, at both attempts
            image[3, 4, 1] = np.nan
        return lambda: image

    monkeypatch.setattr(renderer._tracer, "radiance", broken)
    patches = renderer.render_patches(states(1), resolution=40, seed=0)
    assert (patches.repaired, patches.masked, len(set(calls))) == (1, 1, 4)
    for each in (patches.log_radiance, patches.first_half):
        assert torch.isfinite(each).all()
        assert (each[0, 3, 4] == 0).all()
        assert (each[0, 3, 5] > 0).all()


def test_only_the_patch_that_is_not_finite_is_rendered_again(load_box, monkeypatch) -> None:
    renderer = load_box("llvm", buffer_samples=1, patch_size=16)
    whole = renderer.render_patches(states(4), resolution=40, seed=0)
    radiance = renderer._tracer.radiance
    seeds = []

    def broken(window, *, samples, seed):
        seeds.append(seed)
        image = radiance(window, samples=samples, seed=seed)().clone()
        if len(seeds) == 3:
            image[0, 0, 0] = np.inf
        return lambda: image

    monkeypatch.setattr(renderer._tracer, "radiance", broken)
    patches = renderer.render_patches(states(4), resolution=40, seed=0)
    assert (patches.repaired, patches.masked, len(set(seeds))) == (1, 0, 5)
    same = [
        torch.equal(a, b) for a, b in zip(patches.log_radiance, whole.log_radiance, strict=True)
    ]
    assert same == [True, True, False, True]
    assert torch.isfinite(patches.log_radiance).all()
    assert torch.equal(patches.buffers, whole.buffers)
