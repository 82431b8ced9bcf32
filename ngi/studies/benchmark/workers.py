"""Patches per second of several processes that render."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial

from ngi.machine.size import usable_cores
from ngi.machine.timing import alternated
from ngi.studies.benchmark import PATCHES
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene

AHEAD = 4
"""Batches that are asked for at once, so that no worker waits for the next."""
BEYOND = 16
"""Up to how many workers the throughput is computed that this machine has no cores for."""


def throughput(
    scene: Scene, *, samples_per_pixel: int | None, repeats: int, seconds: float
) -> list[Figure]:
    """Patches per second in one process and with 1, 2, 4, ... workers, up to the cores at hand.

    What more cores would give is computed: as much per worker as the most workers gave here.
    """
    counts = worker_counts(usable_cores())
    make = partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)
    with ExitStack() as stack:
        renderers = [stack.enter_context(remote(partial(make, workers=n))) for n in counts]
        timings = alternated(
            repeats,
            f"workers, {scene.name}",
            *(partial(batches, Batches.render, AHEAD) for batches in renderers),
            seconds=seconds,
        )
    return throughput_figures(counts, timings)


def throughput_figures(counts: Sequence[int], timings: Sequence[Sequence[float]]) -> list[Figure]:
    """timings: for each number of workers, 0 first, the seconds of `AHEAD` batches, in turn."""
    rates = [[AHEAD * PATCHES / t for t in times] for times in timings]
    in_one_process, most = rates[0], rates[-1]
    figures = [
        figure(_workers(n) if n else "in one process", rate, "patches/s")
        for n, rate in zip(counts, rates, strict=True)
    ]
    figures += [
        figure(f"{_workers(n)} / in one process", ratio(rate, in_one_process), "×")
        for n, rate in zip(counts[1:], rates[1:], strict=True)
    ]
    computed = [n for n in worker_counts(BEYOND) if n > counts[-1]]
    return figures + [
        figure(
            f"{n} workers of {n} cores, computed", [r * n / counts[-1] for r in most], "patches/s"
        )
        for n in computed
    ]


def worker_counts(most: int) -> list[int]:
    """0, the powers of two below `most`, and `most`."""
    return [0, *(2**k for k in range(most.bit_length()) if 2**k < most), most]


def _workers(count: int) -> str:
    return f"{count} worker{'s' * (count > 1)}"
