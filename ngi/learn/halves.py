"""Patches traced in two halves, so that how noisy they are is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from ngi.render.protocol import PatchJob, RenderedPatches


class HalvesJob:
    """The `PatchJob` of the mean of two renderings of the same patches, with other random numbers.

    Their buffers are those of the first; they have no noise. What it costs beside one rendering of
    twice the samples is that the buffers are made twice.
    """

    def __init__(self, first: PatchJob, second: PatchJob) -> None:
        self._jobs = first, second

    def done(self) -> bool:
        """See `PatchJob.done`."""
        return all(job.done() for job in self._jobs)

    def result(self) -> RenderedPatches:
        """See `PatchJob.result`; with `first_half`."""
        return self._joined

    @cached_property
    def _joined(self) -> RenderedPatches:
        first, second = (job.result() for job in self._jobs)
        mean = (first.log_radiance.expm1() + second.log_radiance.expm1()) / 2
        return replace(
            first,
            log_radiance=mean.log1p(),
            repaired=first.repaired + second.repaired,
            masked=first.masked + second.masked,
            paths=first.paths + second.paths,
            first_half=first.log_radiance,
        )
