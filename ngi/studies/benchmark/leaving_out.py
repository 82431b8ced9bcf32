"""Generation of patches against generation that leaves nothing out."""

from __future__ import annotations

from functools import partial

from ngi.machine.timing import alternated
from ngi.patches import Patches
from ngi.reuse import PatchStore
from ngi.studies.benchmark import PATCH_SIZE, PATCHES
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene


def leaving_out(
    scene: Scene, *, samples_per_pixel: int | None, repeats: int, seconds: float
) -> list[Figure]:
    """Seconds and bytes per patch with everything, and with only what the scene needs.

    Everything: all buffers, rendered anew for every patch, and all geometry at the top level.
    seconds: of all timings of the scene.
    """
    make = partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)
    with (
        remote(partial(make, needed_only=False)) as everything,
        remote(partial(make, needed_only=True)) as needed,
    ):
        seconds_of_all, seconds_of_needed = alternated(
            repeats,
            f"leaving out, {scene.name}",
            partial(everything, Batches.render),
            partial(needed, Batches.render),
            seconds=seconds,
        )
        bytes_of_all, bytes_of_needed = everything(stored_bytes), needed(stored_bytes)
    return [
        figure("patch, everything", [1e3 * t / PATCHES for t in seconds_of_all], "ms"),
        figure("patch, needed", [1e3 * t / PATCHES for t in seconds_of_needed], "ms"),
        figure("needed / everything", ratio(seconds_of_needed, seconds_of_all), "×"),
        figure("stored patch, everything", [bytes_of_all], "bytes"),
        figure("stored patch, needed", [bytes_of_needed], "bytes"),
    ]


def stored_bytes(batches: Batches) -> float:
    """What one of its patches takes in the store."""
    renderer = batches.renderer
    patches = PatchStore(capacity=1, layout=renderer.layout)
    patches.add(
        Patches.blank(
            1, layout=renderer.layout, dimensions=renderer.dimensions, patch_size=PATCH_SIZE
        )
    )
    return patches.bytes_per_patch
