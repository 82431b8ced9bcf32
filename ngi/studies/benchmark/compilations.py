"""What a scene's kernels cost to compile, and whether any is compiled after the warm-up."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tqdm import tqdm

from ngi.studies.benchmark import PATCHES
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.measure import KernelCounts, counted_kernels
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene

CACHES = ("DRJIT_CACHE_DIR", "OPTIX_CACHE_PATH", "CUDA_CACHE_PATH")
"""Environment variables that say where compiled kernels are kept between processes."""


def compilations(scene: Scene, *, samples_per_pixel: int | None, patches: int) -> list[Figure]:
    """Seconds of the warm-up with an empty cache and in the next process; kernels after it.

    A kernel counts as compiled where it was not in the process's memory, see `counted_kernels`.
    Recordings are those of Dr.Jit's frozen functions; a material that varies takes several, which
    compile nothing new.
    """
    make = partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)
    with TemporaryDirectory() as folder:
        with remote(make, environment=empty_caches(Path(folder))) as batches:
            cold, first = batches(warm_up)
            later = kernels_of_batches(batches, scene.name, patches)
        with remote(make, environment=empty_caches(Path(folder))) as batches:
            warm, _ = batches(warm_up)
    batched = PATCHES * -(-patches // PATCHES)
    return [
        figure("warm-up, no kernel in the cache", [cold], "s", "≤ 20"),
        figure("warm-up, kernels in the cache", [warm], "s"),
        figure("kernels compiled by the warm-up", [first.compiled], ""),
        figure(f"kernels compiled in {batched:,} patches after it", [later.compiled], "", "0"),
        figure(f"recordings in {batched:,} patches after it", [later.recorded], ""),
    ]


def empty_caches(folder: Path) -> dict[str, str]:
    """Environment of a process that finds in this folder what an earlier one compiled."""
    return {variable: str(folder / variable) for variable in CACHES}


def kernels_of_batches(batches: Callable[..., Any], title: str, patches: int) -> KernelCounts:
    """All that were launched for so many patches, in whole batches."""
    total = KernelCounts()
    for _ in tqdm(range(0, patches, PATCHES), desc=f"compilations, {title}", leave=False):
        kernels = batches(kernels_of_batch)
        total.compiled += kernels.compiled
        total.recorded += kernels.recorded
    return total


def warm_up(batches: Batches) -> tuple[float, KernelCounts]:
    """Seconds and kernels of the renderer's warm-up."""
    with counted_kernels() as kernels:
        start = time.perf_counter()
        batches.warm_up()
        seconds = time.perf_counter() - start
    return seconds, kernels


def kernels_of_batch(batches: Batches) -> KernelCounts:
    """Of the next batch; one at a time, since Dr.Jit keeps the source of every launch."""
    with counted_kernels() as kernels:
        batches.render()
    return kernels
