"""Renderers whose patches come late: from another thread, or when the test says so."""

import time
from concurrent.futures import Future, ThreadPoolExecutor

from torch import Tensor

from ngi.render import AnalyticRenderer
from ngi.render.protocol import PatchJob, RenderedPatches


class FutureJob:
    def __init__(self, future: "Future[RenderedPatches]") -> None:
        self._future = future
        self.done, self.result = future.done, future.result


class InThread(AnalyticRenderer):
    """Renders in another thread, slowly enough for some patches to be late."""

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        super().__init__(dimensions=3, patch_size=12, noise=0.1)
        self._pool = pool

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:  # type: ignore[override]
        def render() -> RenderedPatches:
            time.sleep(0.01)
            return self.render_patches(states, resolution=resolution, seed=seed)

        return FutureJob(self._pool.submit(render))


class ManualJob:
    """Is done when the test says so, or after somebody has waited for it."""

    def __init__(self, rendered: RenderedPatches, timer: "Timer") -> None:
        self._rendered = rendered
        self._timer = timer
        self.finished = False
        self.waited = False

    def done(self) -> bool:
        return self.finished

    def result(self) -> RenderedPatches:
        if not self.finished:
            self._timer.now += 5
            self.finished = self.waited = True
        return self._rendered


class Manual(AnalyticRenderer):
    """Keeps the jobs it was given, and what for."""

    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)
        self.timer = Timer()
        self.jobs: list[ManualJob] = []
        self.asked: list[tuple[Tensor, int]] = []

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> ManualJob:  # type: ignore[override]
        rendered = self.render_patches(states, resolution=resolution, seed=seed)
        self.jobs.append(ManualJob(rendered, self.timer))
        self.asked.append((states, resolution))
        return self.jobs[-1]

    @property
    def waited(self) -> int:
        return sum(job.waited for job in self.jobs)


class Timer:
    """Seconds that pass only while somebody waits for a `ManualJob`."""

    now = 0.0

    def __call__(self) -> float:
        return self.now
