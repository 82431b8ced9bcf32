"""How paths are divided into launches."""

import pytest

from ngi.render.tracing import PATHS_PER_LAUNCH, bands, passes


@pytest.mark.parametrize("samples", [1, 200, 4096, 4097, 5001, 24_000])
def test_passes_are_few_and_alike(samples) -> None:
    sizes = passes(samples, 32 * 32)
    assert sum(sizes) == samples
    assert max(sizes) - min(sizes) <= 1
    assert max(sizes) * 32 * 32 <= PATHS_PER_LAUNCH
    assert len(sizes) == 1 or (len(sizes) - 1) * PATHS_PER_LAUNCH < samples * 32 * 32


@pytest.mark.parametrize("samples", [1, 3])
def test_no_pass_is_without_samples(samples) -> None:
    """Of a picture of which one sample per pixel is more than a launch takes."""
    assert passes(samples, 5 * PATHS_PER_LAUNCH) == [1] * samples


@pytest.mark.parametrize(("resolution", "samples"), [(32, 1), (600, 16), (600, 256), (3000, 4096)])
def test_bands_cover_the_image_once(resolution, samples) -> None:
    windows = bands(resolution, samples)
    rows = [row for window in windows for row in range(window.y, window.y + window.height)]
    assert rows == list(range(resolution))
    assert {(w.x, w.width, w.resolution) for w in windows} == {(0, resolution, resolution)}
    assert all(
        w.height == 1 or w.height * resolution * samples <= PATHS_PER_LAUNCH for w in windows
    )
