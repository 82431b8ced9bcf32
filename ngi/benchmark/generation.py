"""Generation of patches against the path tracer alone, and against leaving nothing out."""

from __future__ import annotations

import gc
from collections.abc import Callable

import torch

from ngi.benchmark.figures import Figure, figure, in_turn, ratio
from ngi.benchmark.training import PATCH_SIZE, PATCHES
from ngi.patches import Patches
from ngi.render.measure import FixedLaunch, counted_compilations
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.reuse import PatchStore
from ngi.scene import read_scene, scenes


def generation(scene: str, samples_per_pixel: int, repeats: int) -> list[Figure]:
    """16 patches with every variable, position and resolution new, against one fixed launch."""
    description = read_scene(**scenes()[scene])
    renderer = MitsubaRenderer(
        scene=description, patch_size=PATCH_SIZE, samples_per_pixel=samples_per_pixel
    )
    paths = PATCHES * PATCH_SIZE**2 * samples_per_pixel
    fixed = FixedLaunch(description, paths=paths, samples_per_pixel=samples_per_pixel)
    calls = iter(range(1_000_000))
    varying = batches(renderer)
    ours, theirs = in_turn(
        repeats, f"generation, {scene}", varying, lambda: fixed.trace(next(calls))
    )
    with counted_compilations() as compiled:
        for _ in range(repeats):
            varying()
    title = f"{scene}, {samples_per_pixel} spp"
    patches = f"in {repeats * PATCHES} patches"
    return [
        figure(f"batch / fixed launch, equal paths ({title})", ratio(ours, theirs), "×", "≤ 1.5"),
        figure(f"batch of {PATCHES} patches ({title})", ours, "s"),
        figure(f"paths traced ({title})", [paths / t / 1e6 for t in ours], "Mpaths/s"),
        figure(f"kernels compiled after warm-up ({title})", compiled, patches, "0"),
    ]  # fmt: skip


def leaving_out(scene: str, samples_per_pixel: int, repeats: int) -> list[Figure]:
    """Seconds and bytes per patch with everything, and with only what the scene needs.

    Everything: all buffers, rendered anew for every patch, and all geometry at the top level. The
    two are not timed in turn but one after the other.
    """
    seconds: list[list[float]] = []
    sizes: list[float] = []
    for needed_only in (False, True):
        # One after the other: with two scenes in a process Dr.Jit cannot record the second's.
        gc.collect()
        renderer = MitsubaRenderer(
            scene=read_scene(**scenes()[scene]),
            patch_size=PATCH_SIZE,
            samples_per_pixel=samples_per_pixel,
            needed_only=needed_only,
        )
        seconds += in_turn(repeats, f"leaving out, {scene}", batches(renderer))
        sizes.append(stored_bytes(renderer))
        del renderer
    everything, needed = seconds
    size_of_all, size = sizes
    return [
        figure(f"{scene}: ms per patch, everything", [1e3 * t / PATCHES for t in everything], "ms"),
        figure(f"{scene}: ms per patch, needed", [1e3 * t / PATCHES for t in needed], "ms"),
        figure(f"{scene}: needed / everything", ratio(needed, everything), "×"),
        figure(f"{scene}: bytes per patch, everything", [size_of_all], "bytes"),
        figure(f"{scene}: bytes per patch, needed", [size], "bytes"),
    ]


def stored_bytes(renderer: MitsubaRenderer) -> float:
    """What one of its patches takes in the store."""
    patches = PatchStore(capacity=1, layout=renderer.layout)
    patches.add(
        Patches.blank(
            1, layout=renderer.layout, dimensions=renderer.dimensions, patch_size=PATCH_SIZE
        )
    )
    return patches.bytes_per_patch


def batches(renderer: MitsubaRenderer) -> Callable[[], None]:
    """A function that renders 16 patches with every variable, position and resolution new."""
    generator = torch.Generator().manual_seed(0)
    calls = iter(range(1_000_000))

    def render() -> None:
        call = next(calls)
        states = torch.rand(PATCHES, renderer.dimensions + 2, generator=generator)
        renderer.render_patches(states, resolution=128 + 4 * (call % 100), seed=call)

    return render
