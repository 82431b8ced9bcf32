"""Renders patches and images of a variable scene with Mitsuba 3."""

from __future__ import annotations

import gc
import logging
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from ngi.machine.backend import activate, describe, mi
from ngi.patches import LOG_RADIANCE
from ngi.render.direct_light import fewest_rays
from ngi.render.first_hit import first_hit_of
from ngi.render.fitting import FittingTracer
from ngi.render.needs import buffers_are_static
from ngi.render.projection import Projection, require_perspective, require_told_camera
from ngi.render.protocol import RenderedPatches, Renderer
from ngi.render.tracers import tracer_of
from ngi.render.tracing import (
    PATHS_PER_LAUNCH,
    SAMPLES_PER_PASS,
    Pending,
    PixelList,
    Pixels,
    bands,
    check_states,
    choose,
    derive_seed,
    halved,
    passes,
    patch_window,
    require_positive,
)
from ngi.scene import SceneDescription
from ngi.scene.kinds import most_materials
from ngi.scene.moving_points import moving_points
from ngi.scene.variable_scene import VariableScene

_logger = logging.getLogger(__name__)

BUFFER_SAMPLES = {"cuda_ad_rgb": 16, "llvm_ad_rgb": 16, "scalar_rgb": 2}
"""Samples per pixel of the buffers by default; a Python loop takes them in the scalar variant."""


class MitsubaRenderer(Renderer):
    """The `ngi.render.Renderer` of a scene folder (paper, Sec. 4 and 6).

    scene: what `ngi.scene.read_scene` gives for a scene folder.
    backend: 'auto', 'cuda', 'llvm' or 'scalar', see `ngi.machine.backend.activate`.
    patch_size: P, pixels along a patch's side.
    samples_per_pixel: of training patches; the scene's own number where None.
    buffer_samples: rays per pixel of the buffers, `fewest_rays` at least; `BUFFER_SAMPLES` if None.
    specular: 'learned': the buffers are those of the first hit; 'traced': of the first hit that is
        not specular (paper, Fig. 10), see `ngi.render.specular`.
    direct: 'traced': the buffers also hold the direct light, see `ngi.render.direct_light`;
        'with_caustics': caustics as well; 'learned': neither.
    needed_only: leave out what the scene does not need: buffers that tell nothing, static buffers
        rendered again, and most of the rebuilding of what does not move.

    Radiance and buffers are box-filtered, means over the pixel's square. The buffers use the same
    sub-pixel points in every pixel and no random numbers, so they do not depend on the seed. A
    patch's random numbers depend on seed and state alone, not on the rest of the batch.

    Raises ValueError or FileNotFoundError for a bad scene and RuntimeError for a backend that
    does not work here, before anything is rendered.
    """

    def __init__(
        self,
        *,
        scene: SceneDescription,
        backend: str = "auto",
        patch_size: int = 32,
        samples_per_pixel: int | None = None,
        buffer_samples: int | None = None,
        specular: str = "learned",
        direct: str = "learned",
        needed_only: bool = True,
    ) -> None:
        given = {"samples_per_pixel": samples_per_pixel, "buffer_samples": buffer_samples}
        require_positive(
            patch_size=patch_size, **{name: n for name, n in given.items() if n is not None}
        )
        choose("specular", specular, among=("learned", "traced"))
        choose("direct", direct, among=("learned", "traced", "with_caustics"))
        self._variant = activate(backend)
        if direct == "with_caustics" and self._variant == "scalar_rgb":
            raise ValueError(
                "renderer.direct 'with_caustics': Mitsuba's scalar variant is too slow; see what "
                "`ngi doctor` says about LLVM, or train with renderer.direct=traced"
            )
        # Scenes of a sweep's finished jobs are left in cycles, and slow every launch down.
        gc.collect()
        self._scene = VariableScene(scene, arrange=needed_only)
        require_perspective(self._scene.scene, document=scene.document)
        first_hit = first_hit_of(
            self._scene,
            needed_only=needed_only,
            trace_specular=specular == "traced",
            trace_direct=direct != "learned",
            trace_caustics=direct == "with_caustics",
        )
        fewest = self._fewest_rays = fewest_rays(self._scene.scene, first_hit.layout)
        self.buffer_samples = max(buffer_samples or BUFFER_SAMPLES[self._variant], fewest)
        self._tracer = tracer_of(self._variant, self._scene, first_hit)
        self.layout = first_hit.layout
        self._static = needed_only and buffers_are_static(self._scene, self.layout)
        self._static_buffers: dict[int, Tensor] = {}
        self.dimensions = scene.dimensions
        self.patch_size = patch_size
        self.samples_per_pixel = samples_per_pixel or scene.samples_per_pixel
        of_each = halved(self.samples_per_pixel) if self.halves else self.samples_per_pixel
        self._passes = passes(of_each, patch_size**2)
        self.moving_points = moving_points(self._scene)
        self.camera_part = scene.camera_part
        self.scene_hash = scene.scene_hash
        self.description = describe(self._variant)

    def warm_up(self) -> None:
        """Of each size one launch, with every material seen."""
        mi.set_variant(self._variant)
        sizes = sorted(set(self._passes))
        count = max(2, most_materials(self._scene.description.variables))
        for value in (torch.arange(count) + 0.5) / count:
            state = value.expand(self.dimensions + 2)
            for pending in self._launch_patch(state, 2 * self.patch_size, 0, sizes=sizes):
                pending()

    def render_patches(self, states: Tensor, *, resolution: int, seed: int) -> RenderedPatches:
        """All patches are launched before the first is read, so that Python's part of the work
        runs beside the tracing where the scene's update does not have to wait for it.
        """
        check_states(states, self.dimensions)
        mi.set_variant(self._variant)
        sizes = self._passes
        pending = [self._launch_patch(state, resolution, seed, sizes=sizes) for state in states]
        results = [(radiance(), buffers()) for radiance, buffers in pending]
        again = _broken(results)
        for index in again:
            retry = self._launch_patch(states[index], resolution, seed, sizes=sizes, attempt=1)
            results[index] = retry[0](), retry[1]()
        masked = [again[place] for place in _broken([results[index] for index in again])]
        for index in masked:
            results[index] = _masked(results[index][0]), _masked(results[index][1])
        P = self.patch_size
        radiance_tensor = _stack([r for r, _ in results], (P, P, 6 if self.halves else 3))
        means = radiance_tensor.split(3, dim=-1)
        buffer_tensor = _stack([b for _, b in results], (P, P, self.layout.channels))
        return RenderedPatches(
            buffers=self._encode(buffer_tensor),
            log_radiance=torch.log1p(torch.stack(means).mean(dim=0)),
            repaired=len(again),
            masked=len(masked),
            paths=(len(states) + len(again)) * P * P * self.samples_per_pixel,
            first_half=torch.log1p(means[0]) if self.halves else None,
        )

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        """Memory does not grow with the samples.

        Bands of rows are rendered in passes of at most `SAMPLES_PER_PASS`, summed in double
        precision.
        """
        require_positive(resolution=resolution, samples_per_pixel=samples_per_pixel)
        mi.set_variant(self._variant)
        self._scene.apply(scene_vector)
        state = np.asarray(scene_vector, dtype=np.float32).tobytes()
        rows = []
        for band in bands(resolution, min(samples_per_pixel, SAMPLES_PER_PASS)):
            total = torch.zeros(band.height, resolution, 3, dtype=torch.float64)
            for start in range(0, samples_per_pixel, SAMPLES_PER_PASS):
                samples = min(SAMPLES_PER_PASS, samples_per_pixel - start)
                number = derive_seed(seed, state, resolution, band.y, start)
                radiance = self._tracer.radiance(band, samples=samples, seed=number)()
                total += samples * radiance.cpu().double()
            rows.append(total / samples_per_pixel)
        return torch.cat(rows).float()

    def image_buffers(
        self, scene_vector: Tensor, *, resolution: int, samples: int | None = None
    ) -> Tensor:
        """The same as a patch's at the same pixels."""
        rays = self._place(scene_vector, resolution=resolution, samples=samples)
        return self._encode(self._whole_buffers(resolution, rays))

    def pixel_buffers(
        self,
        scene_vector: Tensor,
        pixels: Tensor,
        *,
        resolution: int,
        samples: int | None = None,
        caustics: bool = True,
    ) -> Tensor:
        rays = self._place(scene_vector, resolution=resolution, samples=samples)
        parts = pixels.split(max(1, PATHS_PER_LAUNCH // rays))
        listed = [PixelList(part, resolution, caustics=caustics) for part in parts]
        return self._encode(self._mean_buffers(listed, rays))

    def cameras(self, scene_vectors: Tensor) -> Tensor:
        require_told_camera(self._scene)
        return torch.from_numpy(self._scene.description.cameras(scene_vectors.numpy())).float()

    def projections(self, scene_vectors: Tensor) -> Tensor:
        return torch.from_numpy(self._projection.matrices(scene_vectors.numpy())).float()

    @cached_property
    def _projection(self) -> Projection:
        mi.set_variant(self._variant)
        return Projection(self._scene)

    def hard_frames(self) -> Tensor:
        """[10, D]: the scene's hard test frames (paper, Sec. 7.2.1)."""
        return torch.tensor(self._scene.description.hard_frames, dtype=torch.float32)

    def close(self) -> None:
        """Says how many launches did not fit into memory."""
        if isinstance(self._tracer, FittingTracer) and (split := self._tracer.split):
            _logger.warning("%d launches did not fit into memory and were traced in parts", split)

    def _place(self, scene_vector: Tensor, *, resolution: int, samples: int | None) -> int:
        """Sets the scene to v; how many rays a pixel has where `samples` are asked for."""
        require_positive(resolution=resolution, samples=1 if samples is None else samples)
        mi.set_variant(self._variant)
        self._scene.apply(scene_vector)
        return max(samples or self.buffer_samples, self._fewest_rays)

    def _launch_patch(
        self, state: Tensor, resolution: int, seed: int, *, sizes: list[int], attempt: int = 0
    ) -> tuple[Pending, Pending]:
        """Radiance, that of both halves one after the other in the last axis, and buffers.

        sizes: samples per pixel of each launch, of one half where there are two
        """
        window = patch_window(state[-2:], patch_size=self.patch_size, resolution=resolution)
        self._scene.apply(state[:-2])
        parts = (seed, state.numpy().tobytes(), resolution, attempt)
        launched = sizes * (2 if self.halves else 1)
        launches = [
            self._tracer.radiance(window, samples=samples, seed=derive_seed(*parts, i))
            for i, samples in enumerate(launched)
        ]

        def radiance() -> Tensor:
            sums = [n * mean() for n, mean in zip(launched, launches, strict=True)]
            halves = torch.stack(sums).split(len(sizes))
            return torch.cat([half.sum(dim=0) / sum(sizes) for half in halves], dim=-1)

        if not self._static:
            return radiance, self._tracer.buffers(window, samples=self.buffer_samples)
        if resolution not in self._static_buffers:  # of the growing resolutions, the last one
            whole = self._whole_buffers(resolution, self.buffer_samples)
            self._static_buffers = {resolution: whole}
        rows = slice(window.y, window.y + window.height)
        columns = slice(window.x, window.x + window.width)
        buffers = self._static_buffers[resolution][rows, columns]
        return radiance, lambda: buffers

    def _whole_buffers(self, resolution: int, samples: int) -> Tensor:
        """[H, W, C] of the scene as it stands, as `_mean_buffers`."""
        return self._mean_buffers(bands(resolution, samples), samples)

    def _mean_buffers(self, parts: Sequence[Pixels], samples: int) -> Tensor:
        """[..., C] of all of them one after the other, radiance linear; no NaN or Inf."""
        return _masked(torch.cat([self._tracer.buffers(p, samples=samples)() for p in parts]))

    def _encode(self, buffers: Tensor) -> Tensor:
        """Emission and direct light become log1p of their means, in place."""
        for name in LOG_RADIANCE.intersection(self.layout.names):
            buffers[..., self.layout.slice(name)].log1p_()
        return buffers


class HalvesRenderer(MitsubaRenderer):
    """Patches have `RenderedPatches.first_half`; ValueError for an odd number of samples."""

    halves = True


def _broken(patches: list[tuple[Tensor, Tensor]]) -> list[int]:
    """Which of them hold a NaN or Inf; the host waits for all of them at once."""
    if not patches:
        return []
    finite = torch.stack([t.isfinite().all() for patch in patches for t in patch]).view(-1, 2)
    return [index for index, whole in enumerate(finite.all(dim=1).tolist()) if not whole]


def _masked(tensor: Tensor) -> Tensor:
    """Every pixel that holds a NaN or Inf set to zero, in all of its channels."""
    return tensor.where(tensor.isfinite().all(dim=-1, keepdim=True), 0)


def _stack(tensors: list[Tensor], shape: tuple[int, ...]) -> Tensor:
    return torch.stack(tensors) if tensors else torch.empty(0, *shape)
