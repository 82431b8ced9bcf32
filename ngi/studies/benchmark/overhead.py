"""Generation of patches against the path tracer alone, and where the difference comes from."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ngi.machine.timing import alternated, repeated
from ngi.studies.benchmark import PATCH_SIZE
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.measure import STEPS, FixedLaunch, timed_steps
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene

REST = "everything else"
BATCH = "all, one after the other"
LONGEST = 2**25
"""Paths of a batch above which it has fewer patches: tens of seconds on two cores."""


def overhead(
    scene: Scene, *, samples_per_pixel: int | None, repeats: int, seconds: float
) -> list[Figure]:
    """16 patches with every variable, position and resolution new, against one fixed launch.

    The launch traces as many paths of one configuration in a process of its own. Where the rest of
    the time goes is timed in a pass of its own that waits for each step before the next begins;
    otherwise Python's steps go on beside the kernels, and a patch takes less than their sum.

    samples_per_pixel: None for the scene's own number. seconds: of each of the two passes.
    """
    make = partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)
    with remote(make) as batches:
        batches(Batches.warm_up)
        batches(Batches.settle)
        samples = batches(_samples_per_pixel)
        patches = patches_of_batch(samples)
        paths = patches * PATCH_SIZE**2 * samples
        with remote(partial(_fixed_launch, scene, paths, samples)) as launch:
            ours, theirs = alternated(
                repeats,
                f"overhead, {scene.name}",
                partial(batches, Batches.render, patches=patches),
                partial(launch, FixedLaunch.trace, seed=0),
                seconds=seconds,
                warm=True,
            )
        steps = repeated(
            repeats,
            f"steps, {scene.name}",
            partial(batches, seconds_by_step, patches),
            seconds=seconds,
            fewest=1,
            warm=True,
        )
    limit = "≤ 1.25" if samples_per_pixel is None else "≤ 2" if samples == 16 else ""
    figures = [
        figure("samples per pixel", [samples], ""),
        figure("patches per batch", [patches], ""),
        figure("batch / fixed launch, equal paths", ratio(ours, theirs), "×", limit),
        figure("patch", [1e3 * t / patches for t in ours], "ms"),
        figure("fixed launch, per patch", [1e3 * t / patches for t in theirs], "ms"),
        figure("paths traced", [paths / t / 1e6 for t in ours], "million/s"),
    ]
    return [*(replace(f, part="overhead") for f in figures), *step_figures(steps, patches)]


def patches_of_batch(samples: int) -> int:
    """16, or 4 or 1 where their paths would be more than `LONGEST`; the launch is a square."""
    few_enough = (n for n in (16, 4) if n * PATCH_SIZE**2 * samples <= LONGEST)
    return next(few_enough, 1)


def seconds_by_step(batches: Batches, patches: int) -> dict[str, float]:
    """Of the next batch: seconds of every one of `STEPS`, of the `REST`, and of the `BATCH`."""
    with timed_steps() as seconds:
        batch = batches.render(patches=patches)
    return {**seconds, REST: batch - sum(seconds.values()), BATCH: batch}


def step_figures(steps: list[dict[str, float]], patches: int) -> list[Figure]:
    """Milliseconds per patch of each step, and its share of the batch."""
    milliseconds = [
        figure(step, [1e3 * seconds[step] / patches for seconds in steps], "ms")
        for step in (*STEPS, REST, BATCH)
    ]
    shares = [
        figure(step, [100 * seconds[step] / seconds[BATCH] for seconds in steps], "%")
        for step in (*STEPS, REST)
    ]
    return [
        *(replace(f, part="overhead: steps of a patch") for f in milliseconds),
        *(replace(f, part="overhead: shares of these steps") for f in shares),
    ]


def _samples_per_pixel(batches: Batches) -> int:
    return batches.renderer.samples_per_pixel


def _fixed_launch(scene: Scene, paths: int, samples_per_pixel: int) -> FixedLaunch:
    launch = FixedLaunch(scene.read(), paths=paths, samples_per_pixel=samples_per_pixel)
    launch.warm_up()
    return launch
