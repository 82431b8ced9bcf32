"""How many paths are traced at a time."""

from __future__ import annotations

from ngi.render.tracing import Window

PATHS_PER_LAUNCH = 2**22
"""Images and patches are traced in launches of about this many paths at most: about 200 MB."""

SAMPLES_PER_PASS = 256
"""Samples of an image's pixel that are summed in single precision before double takes over."""


def bands(resolution: int, samples: int) -> list[Window]:
    """The rows of a square image, as many at a time as `PATHS_PER_LAUNCH` allows."""
    rows = min(resolution, max(1, PATHS_PER_LAUNCH // (resolution * samples)))
    return [
        Window(0, y, resolution, min(rows, resolution - y), resolution)
        for y in range(0, resolution, rows)
    ]


def passes(samples: int, pixels: int) -> list[int]:
    """Samples per pixel of each launch: as few launches as `PATHS_PER_LAUNCH` allows, alike."""
    count = -(-samples * pixels // PATHS_PER_LAUNCH)
    return [samples // count + (i < samples % count) for i in range(count)]
