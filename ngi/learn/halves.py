"""Patches traced in two halves, so that how noisy they are is known."""

from __future__ import annotations

from dataclasses import replace

from ngi.render.protocol import RenderedPatches


def mean_of_halves(first: RenderedPatches, second: RenderedPatches) -> RenderedPatches:
    """The mean of two renderings of the same patches, with other random numbers; `first_half` too.

    Their buffers are those of the first; they have no noise. What it costs beside one rendering of
    twice the samples is that the buffers are made twice.
    """
    mean = (first.log_radiance.expm1() + second.log_radiance.expm1()) / 2
    return replace(
        first,
        log_radiance=mean.log1p(),
        repaired=first.repaired + second.repaired,
        masked=first.masked + second.masked,
        paths=first.paths + second.paths,
        first_half=first.log_radiance,
    )
