"""Memory, precision and speed of the store of patches."""

from __future__ import annotations

import torch

from ngi.machine.timing import in_turn
from ngi.patches import BufferLayout
from ngi.reuse import PatchStore
from ngi.studies.benchmark import PATCHES
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.training import random_patches


def store(dimensions: int, count: int, repeats: int) -> list[Figure]:
    """Memory per patch, the error of half precision, and the time of a draw."""
    layout = BufferLayout()
    patches = PatchStore(capacity=count, layout=layout)
    original = random_patches(layout, dimensions)
    ids = patches.add(original)
    error = (patches.get(ids).log_radiance - original.log_radiance).abs().max().item()
    for _ in range(count // PATCHES - 1):
        ids = patches.add(original)
        patches.update(ids, torch.rand(PATCHES))
    generator = torch.Generator().manual_seed(0)
    (draws,) = in_turn(repeats, "store", lambda: patches.get(patches.draw(PATCHES, generator)))
    size = patches.bytes_per_patch
    title = f"{dimensions} variables"
    return [
        figure(f"store, memory per patch ({title})", [size], "bytes", "≤ 48,000"),
        figure("store, largest error of half precision, log1p radiance in [0, 1]", [error], ""),
        figure(f"store, drawing {PATCHES} of {count:,} patches", [1e3 * t for t in draws], "ms"),
    ]  # fmt: skip
