"""The running totals of a run."""

import torch

from ngi.clock.counters import Counters
from ngi.render.protocol import RenderedPatches


def test_patches_paths_and_what_was_mended_add_up_over_the_batches() -> None:
    """Here two samples of five images of 4 x 4 pixels each."""
    counters = Counters(batches_refused=1)
    rendered = RenderedPatches(
        buffers=torch.zeros(2, 5, 4, 4, 6),
        log_radiance=torch.zeros(2, 5, 4, 4, 3),
        repaired=3,
        masked=1,
        paths=7,
    )
    for _ in range(2):
        counters.count_generated(rendered)
    assert counters == Counters(
        generated_batches=2,
        patches_traced=20,
        paths_traced=14,
        patches_repaired=6,
        patches_masked=2,
        batches_refused=1,
    )
    assert counters.proposed_batches == 3
