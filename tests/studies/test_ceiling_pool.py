"""The pool of patches of the study of what a choice of patches could gain."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

from ngi.explore import Always, ConstantTarget, MarkovChains, NormalPerturbation
from ngi.learn import PatchSamples
from ngi.render import AnalyticRenderer
from ngi.render.protocol import RenderedPatches
from ngi.reuse import CompactPatches
from ngi.studies.ceiling.pool import BATCHES_PER_FILE, render_pool
from tests.learn.comparison import assert_same

CHAINS, FILES = 2, 3


class Listed(AnalyticRenderer):
    """Lists the seeds it was given; with that of `broken` one pixel is not a number."""

    def __init__(self, *, broken: int | None = None) -> None:
        super().__init__(dimensions=2, patch_size=8, noise=0.1)
        self.seeds: list[int] = []
        self._broken = broken

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        rendered = super().render_patches(states, resolution=resolution, seed=seed)
        self.seeds.append(seed)
        if seed == self._broken:
            rendered.log_radiance[1, 2, 3] = torch.nan
        return rendered


def pool(folder: Path, renderer: Listed) -> CompactPatches:
    return render_pool(
        folder,
        samples=PatchSamples(renderer=renderer),
        sampler=MarkovChains(
            chains=CHAINS,
            proposal=NormalPerturbation(large_step_probability=1.0, standard_deviation=0.1),
            target=ConstantTarget(),
            acceptance=Always(),
        ),
        resolution=16,
        count=FILES * BATCHES_PER_FILE * CHAINS,
    )


def test_an_interrupted_pool_goes_on_where_it_stopped(tmp_path: Path) -> None:
    """The same patches bit for bit, of which those that are there are not rendered again."""
    first, again = Listed(), Listed()
    whole = pool(tmp_path, first)
    assert first.seeds == list(range(FILES * BATCHES_PER_FILE))
    (tmp_path / "00001.pt").unlink()
    resumed = pool(tmp_path, again)
    assert again.seeds == first.seeds[BATCHES_PER_FILE : 2 * BATCHES_PER_FILE]
    assert_same(resumed.tensors(), whole.tensors())
    assert len(whole.position.unique(dim=0)) == FILES * BATCHES_PER_FILE * CHAINS


def test_patches_that_are_not_finite_end_the_pool_and_are_named(tmp_path: Path) -> None:
    """What was rendered before stays, and with a renderer that works the pool is completed."""
    batch = BATCHES_PER_FILE + 1
    with pytest.raises(FloatingPointError, match=rf"NaN or Inf .* resolution 16, seed {batch}"):
        pool(tmp_path, Listed(broken=batch))
    assert [file.name for file in tmp_path.iterdir()] == ["00000.pt"]
    mended = Listed()
    completed = pool(tmp_path, mended)
    assert mended.seeds[0] == BATCHES_PER_FILE
    assert_same(completed.tensors(), pool(tmp_path / "afresh", Listed()).tensors())
