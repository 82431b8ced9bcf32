"""The patches of a scene that all runs choose from, rendered once."""

from __future__ import annotations

from pathlib import Path

import torch
from tqdm import tqdm

from ngi.explore import Sampler
from ngi.files.durable import write_tensors
from ngi.learn import Samples
from ngi.learn.ahead import ProposalsAhead
from ngi.patches import Patches
from ngi.reuse import CompactPatches

BATCHES_PER_FILE = 8


def check_count(count: int, sampler: Sampler) -> None:
    """Raises ValueError for a number of patches that do not fill whole files."""
    per_file = BATCHES_PER_FILE * sampler.chains
    if count % per_file:
        raise ValueError(f"ceiling.pool: {count}: give a multiple of {per_file}")


def render_pool(
    folder: Path, *, samples: Samples, sampler: Sampler, resolution: int, count: int
) -> CompactPatches:
    """The first `count` patches that `sampler` proposes, from `folder` or rendered into it.

    Files that are there are not rendered again: an interrupted pool goes on where it stopped. The
    seed of a batch's rendering is its number.

    Raises ValueError as `check_count` does.
    """
    check_count(count, sampler)
    per_file = BATCHES_PER_FILE * sampler.chains
    parts = []
    for part in tqdm(range(count // per_file), desc="pool", unit=f"{per_file} patches"):
        file = folder / f"{part:05d}.pt"
        if not file.exists():
            batches = range(part * BATCHES_PER_FILE, (part + 1) * BATCHES_PER_FILE)
            rendered = [_render(batch, samples, sampler, resolution) for batch in batches]
            compact = [CompactPatches.compress(patches, samples.layout) for patches in rendered]
            write_tensors(file, _concatenated(compact).tensors())
        parts.append(CompactPatches(**torch.load(file, weights_only=True)))
    return _concatenated(parts)


def _render(batch: int, samples: Samples, sampler: Sampler, resolution: int) -> Patches:
    """Raises FloatingPointError for patches that hold NaN or Inf."""
    generator = torch.Generator().manual_seed(batch)
    proposals = sampler.propose(sampler.init(samples.dimensions + 2), generator, batch=batch)
    ahead = ProposalsAhead(proposals, resolution=resolution, seed=batch)
    ahead.start(samples)
    if (problem := ahead.unusable()) is not None:
        raise FloatingPointError(problem)
    return ahead.patches().to("cpu")


def _concatenated(parts: list[CompactPatches]) -> CompactPatches:
    names = parts[0].tensors()
    return CompactPatches(**{name: torch.cat([p.tensors()[name] for p in parts]) for name in names})


def chosen(pool: CompactPatches, indices: torch.Tensor) -> Patches:
    """Some patches of the pool, [n], as they are trained on."""
    return CompactPatches(**{n: t[indices] for n, t in pool.tensors().items()}).expand()
