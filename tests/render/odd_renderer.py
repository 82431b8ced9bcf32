"""A renderer for tests of those that render elsewhere, and how its numbers are compared."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from ngi.render import AnalyticRenderer, RenderedPatches
from tests.waiting import wait_for


class OddRenderer(AnalyticRenderer):
    """The analytic one; the first component of v says what else happens to a patch.

    Above 0.9 it is counted as repaired, above 0.95 as masked too. At exactly 0.5 rendering fails,
    and at exactly 0.25 it waits until the file `gate` is there, beside a file named by the process.
    """

    def __init__(self, *, gate: Path) -> None:
        super().__init__(dimensions=3, patch_size=8, noise=0.2)
        self._gate = gate

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        first = states[:, 0]
        if bool((first == 0.5).any()):
            raise KeyError("one half")
        while bool((first == 0.25).any()) and not self._gate.exists():
            self._gate.with_name(str(os.getpid())).touch()
            time.sleep(0.01)
        rendered = super().render_patches(states, resolution=resolution, seed=seed)
        repaired, masked = (int((first > limit).sum()) for limit in (0.9, 0.95))
        return replace(rendered, repaired=repaired, masked=masked)


class PlaceRenderer(AnalyticRenderer):
    """The analytic one, which counts as paths what it sees of the process that it is in."""

    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        rendered = super().render_patches(states, resolution=resolution, seed=seed)
        gpu = int(os.environ.get("CUDA_VISIBLE_DEVICES", -1))
        return replace(rendered, paths=gpu, repaired=os.nice(0), masked=torch.get_num_threads())


def states(n, seed=0, first=None):
    drawn = torch.rand(n, 5, generator=torch.Generator().manual_seed(seed))
    if first is not None:
        drawn[:, 0] = first
    return drawn


def render(renderer, given, seed=7):
    job = renderer.start_patches(given, resolution=20, seed=seed)
    wait_for(job.done)
    return job.result()


def assert_same(a, b) -> None:
    assert torch.equal(a.buffers, b.buffers)
    assert torch.equal(a.log_radiance, b.log_radiance)
    assert (a.repaired, a.masked, a.paths) == (b.repaired, b.masked, b.paths)
    assert (a.first_half is None) == (b.first_half is None)
    assert a.first_half is None or torch.equal(a.first_half, b.first_half)


def processes() -> set[int]:
    """The renderer processes that this one has."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended
            state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
            ours = "worker_process" in (folder / "cmdline").read_text()
            if ours and int(parent) == os.getpid() and state != "Z":
                found.add(int(folder.name))
    return found
