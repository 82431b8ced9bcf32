"""Patches rendered by several processes, of this machine or of a cluster."""

import pickle
import weakref
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Self

import torch
from torch import Tensor

from ngi.files.extras import install_command
from ngi.render.protocol import Deferred, RenderedPatches, Renderer
from ngi.render.tracing import check_states, patch_window
from ngi.render.worker_pool import WorkerPool
from ngi.render.worker_process import WorkerProcess
from ngi.render.worker_protocol import Request, Worker


def mitsuba_renderer(
    *, workers: int, cluster: str | None, halves: bool = False, **options: Any
) -> Renderer:
    """The `MitsubaRenderer` with these options, or workers that have one each.

    halves: the `HalvesRenderer` instead
    workers, cluster: see `WorkerRenderer`; 0 workers: everything is rendered in this process.
    Raises ValueError for a cluster without workers, and what `MitsubaRenderer` and
    `WorkerRenderer` raise.
    """
    from ngi.machine.backend import VARIANTS, activate
    from ngi.render.mitsuba_renderer import HalvesRenderer, MitsubaRenderer

    kind = HalvesRenderer if halves else MitsubaRenderer
    if workers == 0 and cluster is not None:
        raise ValueError(f"renderer.cluster '{cluster}' needs workers; set renderer.workers")
    if workers == 0:
        return kind(**options)
    variant = activate(
        options.pop("backend", "auto")
    )  # 'auto' must not come out differently in a worker
    backend = next(name for name in VARIANTS if VARIANTS[name] == variant)
    return WorkerRenderer(
        partial(kind, backend=backend, **options), workers=workers, cluster=cluster
    )


class WorkerRenderer(Renderer):
    """The `ngi.render.Renderer` whose patches are rendered elsewhere; images are rendered here.

    make: makes the renderer, here and in every worker; can be pickled, and not of `__main__`.
    workers: how many, at least 1. A worker that dies is replaced, with a warning in the log, and
        what it had not rendered is rendered again. So is one that has not answered for far longer
        than its requests take, see `ngi.render.watchdog`; images, which are rendered in this
        process, cannot be interrupted, nor can patches without workers.
    cluster: None for processes of this machine, otherwise the address of a Ray cluster, 'auto' for
        the one that this machine belongs to.

    A batch is cut into chunks, taken by whichever worker is free. Since a patch depends on its
    state, the resolution and the seed alone, the numbers are those of the renderer itself, bit for
    bit. Every worker holds the scene. They start when they are first needed, and end with `close`
    or with this process, however it ends. Raises ValueError for a number of workers below 1, and
    RuntimeError where Ray is missing or has no room for them.
    """

    def __init__(
        self, make: Callable[[], Renderer], *, workers: int, cluster: str | None = None
    ) -> None:
        if workers < 1:
            raise ValueError(
                f"renderer.workers is {workers}; expected 1 or more, or 0 to render in this process"
            )
        self._local = make()
        self.layout = self._local.layout
        self.dimensions = self._local.dimensions
        self.patch_size = self._local.patch_size
        self.samples_per_pixel = self._local.samples_per_pixel
        self.halves = self._local.halves
        self.buffer_samples = self._local.buffer_samples
        self.moving_points = self._local.moving_points
        self.camera_part = self._local.camera_part
        self.scene_hash = self._local.scene_hash
        self._workers = workers
        where = "" if cluster is None else f" on the Ray cluster '{cluster}'"
        self.description = f"{self._local.description}, workers: {workers}{where}"
        start = _starter(pickle.dumps(make), workers=workers, cluster=cluster)
        self._pool = WorkerPool(start, workers)
        self._close = weakref.finalize(self, self._pool.close)

    def warm_up(self) -> None:
        """All workers at the same time."""
        self._pool.warm_up()

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        return self.start_patches(states, resolution=resolution, seed=seed).result()

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> Deferred:
        """What is wrong with states is raised here."""
        check_states(states, self.dimensions)
        for state in states:
            patch_window(state[-2:], patch_size=self.patch_size, resolution=resolution)
        chunks = states.split(list(chunk_sizes(len(states), self._workers)))
        # Copies: a pickled view would take the whole batch with it.
        requests = [Request(chunk.clone(), resolution, seed) for chunk in chunks]
        return Deferred(_joined, *self._pool.submit(requests))

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        return self._local.render_image(
            scene_vector, resolution=resolution, samples_per_pixel=samples_per_pixel, seed=seed
        )

    def image_buffers(
        self, scene_vector: Tensor, *, resolution: int, samples: int | None = None
    ) -> Tensor:
        return self._local.image_buffers(scene_vector, resolution=resolution, samples=samples)

    def pixel_buffers(
        self,
        scene_vector: Tensor,
        pixels: Tensor,
        *,
        resolution: int,
        samples: int | None = None,
        caustics: bool = True,
    ) -> Tensor:
        return self._local.pixel_buffers(
            scene_vector, pixels, resolution=resolution, samples=samples, caustics=caustics
        )

    def cameras(self, scene_vectors: Tensor) -> Tensor:
        return self._local.cameras(scene_vectors)

    def projections(self, scene_vectors: Tensor) -> Tensor:
        return self._local.projections(scene_vectors)

    def hard_frames(self) -> Tensor:
        return self._local.hard_frames()

    def close(self) -> None:
        """A `with` block does it too."""
        self._close()
        self._local.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def _starter(make: bytes, *, workers: int, cluster: str | None) -> Callable[[int], Worker]:
    if cluster is None:
        return partial(WorkerProcess, of=workers, make=make)
    try:
        from ngi.render.ray_workers import RayWorker, join_cluster
    except ModuleNotFoundError as error:
        raise RuntimeError(
            f"renderer.cluster '{cluster}' needs Ray; get it with `{install_command('ray')}`"
        ) from error
    return partial(RayWorker, share=join_cluster(cluster, workers=workers), make=make)


def _joined(*chunks: RenderedPatches) -> RenderedPatches:
    """A batch that was rendered in chunks."""
    halves = [chunk.first_half for chunk in chunks if chunk.first_half is not None]
    return RenderedPatches(
        buffers=torch.cat([chunk.buffers for chunk in chunks]),
        log_radiance=torch.cat([chunk.log_radiance for chunk in chunks]),
        repaired=sum(chunk.repaired for chunk in chunks),
        masked=sum(chunk.masked for chunk in chunks),
        paths=sum(chunk.paths for chunk in chunks),
        first_half=torch.cat(halves) if halves else None,
    )


def chunk_sizes(patches: int, workers: int) -> Iterator[int]:
    """Large chunks first, then smaller ones, so that all workers end at about the same time.

    Patches differ in cost. (The same as OpenMP's guided schedule.) No patches are one chunk.
    """
    while True:
        size = max(min(1, patches), patches // (2 * workers))
        yield size
        patches -= size
        if patches == 0:
            return
