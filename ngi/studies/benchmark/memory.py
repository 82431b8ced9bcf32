"""Whether rendering patches leaks memory."""

from __future__ import annotations

import resource
from collections.abc import Sequence
from functools import partial

import numpy as np
import torch
from scipy.stats import linregress
from tqdm import tqdm

from ngi.machine.memory import resident_bytes
from ngi.studies.benchmark import PATCHES
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene

LEFT_OUT = 0.1
"""The part of the patches in which memory may still grow: caches fill, films get larger."""
LEAST_BATCHES = 4

LONG = 10_000
"""Patches over which the growth is compared with the peak."""


def memory(scene: Scene, *, samples_per_pixel: int | None, patches: int) -> list[Figure]:
    """Growth and peak of a process that renders patches in batches of 16 and keeps none.

    Raises ValueError for too few of them to tell a growth.
    """
    if patches < (least := LEAST_BATCHES * PATCHES):
        raise ValueError(f"patches={patches}: memory's growth takes at least {least}")
    make = partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)
    with remote(make) as batches:
        used = [
            batches(memory_after_batch)
            for _ in tqdm(range(0, patches, PATCHES), desc=f"memory, {scene.name}", leave=False)
        ]
        peak = batches(peak_memory)
    main, gpu = zip(*used, strict=True)
    figures = growth_figures(main, peak=peak)
    if any(gpu):
        figures += growth_figures(gpu, peak=max(gpu), of="GPU, ")
    return figures


def growth_figures(used: Sequence[float], *, peak: float, of: str = "") -> list[Figure]:
    """used: bytes after each batch."""
    patches = PATCHES * np.arange(1, len(used) + 1)
    settled = int(LEFT_OUT * len(used))
    line = linregress(patches[settled:], np.asarray(used[settled:], dtype=float))
    return [
        figure(f"{of}growth per patch, least squares", [line.slope], "bytes"),
        figure(f"{of}standard error of the growth", [line.stderr], "bytes"),
        figure(
            f"{of}growth in {LONG:,} patches / peak",
            [100 * LONG * line.slope / peak],
            "%",
            "< 1",
        ),
        figure(f"{of}peak", [peak / 2**20], "MiB"),
    ]


def memory_after_batch(batches: Batches) -> tuple[int, int]:
    """Bytes of main memory that the process holds after another batch, and of its GPU's."""
    batches.render()
    free, total = torch.cuda.mem_get_info() if torch.cuda.is_available() else (0, 0)
    return resident_bytes() or 0, total - free


def peak_memory(_: Batches) -> int:
    """Bytes, the most that the process ever held."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
