"""Images and patches that are traced in several launches, by bands of rows and by samples."""

import numpy as np
import torch

from tests.render.box import V, states, windows_of_buffers


def test_image_is_the_mean_of_its_passes(load_box, monkeypatch) -> None:
    """Of each band by their samples, and no two launches share their random numbers."""
    renderer = load_box("llvm", buffer_samples=1, patch_size=16)
    whole = renderer.render_image(V, resolution=16, samples_per_pixel=512, seed=0)
    buffers = renderer.image_buffers(V, resolution=16)
    weighted, seeds = {}, set()
    trace = renderer._tracer.radiance

    def watched(window, *, samples, seed):
        radiance = trace(window, samples=samples, seed=seed)()
        weighted.setdefault(window.y, []).append((samples, radiance.double().numpy()))
        seeds.add(seed)
        return lambda: radiance

    monkeypatch.setattr(renderer._tracer, "radiance", watched)
    monkeypatch.setattr("ngi.render.mitsuba_renderer.SAMPLES_PER_PASS", 100)
    monkeypatch.setattr("ngi.render.tracing.PATHS_PER_LAUNCH", 100 * 16 * 5)
    passes = renderer.render_image(V, resolution=16, samples_per_pixel=512, seed=0)
    bands = [weighted[first_row] for first_row in (0, 5, 10, 15)]
    assert all([n for n, _ in band] == [*5 * [100], 12] for band in bands)
    means = [sum(n * radiance for n, radiance in band) / 512 for band in bands]
    np.testing.assert_allclose(passes, np.concatenate(means), rtol=1e-6)
    assert len(seeds) == 4 * 6
    # Away from the lamp, whose edges are the noisiest part of the picture.
    dark = (buffers[..., renderer.layout.slice("emission")] == 0).all(-1)
    dark &= whole.amax(-1) < 1
    torch.testing.assert_close(passes[dark].mean(), whole[dark].mean(), rtol=0.01, atol=0)


def test_buffers_of_an_image_are_the_same_in_bands(load_box, monkeypatch) -> None:
    renderer = load_box("llvm", buffer_samples=4, patch_size=16)
    whole = renderer.image_buffers(V, resolution=16)
    windows = windows_of_buffers(renderer, monkeypatch)
    monkeypatch.setattr("ngi.render.tracing.PATHS_PER_LAUNCH", 4 * 16 * 5)
    torch.testing.assert_close(renderer.image_buffers(V, resolution=16), whole)
    assert [window.height for window in windows] == [5, 5, 5, 1]


def test_many_samples_are_traced_in_passes_that_weigh_by_their_samples(
    load_box, monkeypatch
) -> None:
    renderer = load_box("llvm", buffer_samples=1, patch_size=16)
    assert renderer.samples_per_pixel == 8
    monkeypatch.setattr(renderer, "_passes", [3, 3, 2])
    passes = {}

    def numbered(window, *, samples, seed):
        passes[seed] = samples
        image = torch.full((window.height, window.width, 3), float(len(passes)))
        return lambda: image

    monkeypatch.setattr(renderer._tracer, "radiance", numbered)
    patches = renderer.render_patches(states(1), resolution=40, seed=0)
    assert list(passes.values()) == [3, 3, 2]
    mean = (3 * 1 + 3 * 2 + 2 * 3) / 8
    torch.testing.assert_close(patches.log_radiance.expm1(), torch.full((1, 16, 16, 3), mean))
    assert patches.paths == 16 * 16 * 8
