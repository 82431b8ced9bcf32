"""Batches of patches as training asks for them, with everything new in each."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import count

import torch
from torch import Tensor

from ngi.render import Renderer
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.render.workers import WorkerRenderer
from ngi.scene import SceneDescription
from ngi.scene.kinds import most_materials
from ngi.studies.benchmark import PATCH_SIZE, PATCHES

SETTLING = 48
"""Patches after which the combinations of varying materials have come up."""


class Batches:
    """A renderer, and batches of 16 patches with every variable, position and resolution new.

    read: gives the scene.
    samples_per_pixel: the scene's own number, that of training, where None.
    workers: processes that render; 0 for this one.
    """

    def __init__(
        self,
        read: Callable[[], SceneDescription],
        *,
        samples_per_pixel: int | None,
        needed_only: bool = True,
        workers: int = 0,
    ) -> None:
        scene = read()
        self._materials_vary = most_materials(scene.variables) > 0
        make = partial(
            MitsubaRenderer,
            scene=scene,
            patch_size=PATCH_SIZE,
            samples_per_pixel=samples_per_pixel,
            needed_only=needed_only,
        )
        self.renderer: Renderer = WorkerRenderer(make, workers=workers) if workers else make()
        self._generator = torch.Generator().manual_seed(0)
        self._calls = count()

    def warm_up(self) -> None:
        self.renderer.warm_up()

    def settle(self) -> None:
        """Where materials vary, has every combination of them recorded.

        That takes a second each, once in a process, and compiles nothing.
        """
        if self._materials_vary:
            self.render(SETTLING, patches=1)

    def render(self, batches: int = 1, *, patches: int = PATCHES) -> float:
        """Renders the next batches, all started before the first is waited for; their seconds."""
        calls = [(next(self._calls), self._states(patches)) for _ in range(batches)]
        start = time.perf_counter()
        jobs = [
            self.renderer.start_patches(states, resolution=128 + 4 * (call % 100), seed=call)
            for call, states in calls
        ]
        for job in jobs:
            job.result()
        return time.perf_counter() - start

    def _states(self, patches: int) -> Tensor:
        return torch.rand(patches, self.renderer.dimensions + 2, generator=self._generator)
